"""scripts/report.py on recorded flights: a run, a bag alone, one cut off, and bags without a flight."""

import json
from pathlib import Path

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Vector3
from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message
from std_msgs.msg import Header

from relform_analysis.replay.command import main as replay
from relform_analysis.report.command import main
from relform_bags.writer import BagWriter
from relform_core.names import CONFIG_ATTACHMENT, VERSIONS_ATTACHMENT
from relform_msgs.msg import FormationReference, RelativePosition
from support.pages import Page, unpack
from support.scenarios import paper_scenario

SCENARIO = paper_scenario(seed=11)
VEHICLES = SCENARIO.config.team.vehicles
STEPS = 30
REFERENCE = "/formation/reference"
DATA = Path(__file__).parents[1] / "data"


def write_bag(folder: Path, without: str = "") -> Path:
    """A flight along x; its MCAP file."""
    attachments = {
        CONFIG_ATTACHMENT: SCENARIO.effective_yaml,
        VERSIONS_ATTACHMENT: json.dumps({"relform": "7.8.9"}),
    }
    types = {f"/{vehicle}/ground_truth": "nav_msgs/msg/Odometry" for vehicle in VEHICLES}
    types[REFERENCE] = "relform_msgs/msg/FormationReference"
    with BagWriter(folder, attachments) as writer:
        for topic, type_name in types.items():
            if topic != without:
                writer.add_topic(topic, type_name, [])
        for step in range(STEPS):
            header = Header(stamp=Time(sec=step // 20, nanosec=step % 20 * 50_000_000), frame_id="map")
            for topic in types:
                if topic == without:
                    continue
                message = reference(header, step) if topic == REFERENCE else truth(header, topic, step)
                writer.write(topic, serialize_message(message), 50_000_000 * step, 0)
            writer.flush()
    return writer.file


def reference(header: Header, step: int) -> FormationReference:
    formation = [
        RelativePosition(observer_id=observer, target_id=target, position=Vector3(x=-1.0))
        for observer in VEHICLES
        for target in VEHICLES
        if observer != target
    ]
    place = Point(x=0.1 * step, y=0.0, z=2.0)
    return FormationReference(header=header, step=step, phase="A", leader_position=place, formation=formation)


def truth(header: Header, topic: str, step: int) -> Odometry:
    vehicle = topic.split("/")[1]
    message = Odometry(header=header, child_frame_id=f"{vehicle}/base_link")
    message.pose.pose.position = Point(x=0.1 * step - VEHICLES.index(vehicle), y=0.03, z=2.0)
    return message


def test_bag_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = write_bag(tmp_path / "bag")
    assert main([str(file), "--no-figures"]) == 0
    report = file.parent / "report.html"
    output = capsys.readouterr()
    assert output.out == f"{report}\n"
    page = Page(report.read_text())
    lacking = ", ".join((*(f"/{vehicle}/rotor_speeds" for vehicle in VEHICLES), "/formation/solver"))
    assert output.err == f"{file}: no message on {lacking}; left blank in the report\n"
    assert f"Not recorded: {lacking}" in page.text
    assert "The recording ends after 30 of 540 control steps." in page.text
    assert page.tables["versions"] == [["relform", "7.8.9"]]
    np.testing.assert_allclose(unpack(page.data["position"])[:, 0, 0], 0.1 * np.arange(STEPS), rtol=1e-6)
    (leader,) = (row for row in page.tables["phases"] if row[0] == "leader position m")
    assert leader[1:3] == ["mean", "0.030"]
    assert "steady, mean" not in page.text  # the flight did not come to its end


def test_report_of_a_run_has_ending_and_figures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_bag(tmp_path / "run/bag")
    summary = {
        "outcome": "failed",
        "reason": "/leader/quadrotor died",
        "wall_s": 2.0,
        "flown_s": 1.45,
        "versions": {"relform": "1.2.3"},
    }
    (tmp_path / "run/summary.json").write_text(json.dumps(summary))
    out = tmp_path / "elsewhere.html"
    assert main([str(tmp_path / "run"), "--out", str(out)]) == 0
    page = Page(out.read_text())
    assert "Failed at 1.45 s of 27 s, in phase A. /leader/quadrotor died" in page.text
    assert page.tables["versions"] == [["relform", "1.2.3"]]
    names = capsys.readouterr().out.split()
    assert names[0] == str(out)
    assert all(Path(name).is_file() and Path(name).parent == tmp_path / "figures" for name in names[1:])
    assert len(names) == 11


def test_bag_that_was_cut_off(tmp_path: Path) -> None:
    content = write_bag(tmp_path / "bag").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(content[: len(content) // 2])
    assert main([str(tmp_path / "cut.mcap"), "--no-figures"]) == 0
    page = Page((tmp_path / "report.html").read_text())
    assert 0 < len(unpack(page.data["step"])) < STEPS


@pytest.mark.parametrize(
    ("without", "expected"),
    [
        ("/leader/ground_truth", "no flight in it: there is no message on /leader/ground_truth"),
        (REFERENCE, "no flight in it: there is no message on /formation/reference"),
    ],
)
def test_topic_that_is_missing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], without: str, expected: str
) -> None:
    file = write_bag(tmp_path / "bag", without)
    assert main([str(tmp_path / "bag")]) == 2
    assert capsys.readouterr().err == f"error: {file}: {expected}\n"
    assert not (tmp_path / "bag/report.html").exists()


def test_bag_from_elsewhere_and_no_bag(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with BagWriter(tmp_path / "bag", {}) as writer:
        pass
    assert main([str(tmp_path / "bag")]) == 2
    assert capsys.readouterr().err == (
        f"error: {writer.file}: no configuration of the flight: the bag has no attachment config.yaml, and "
        "neither its folder nor the one above holds a config.yaml; name the scenario with --config FILE\n"
    )
    (tmp_path / "picture.mcap").write_bytes(b"\x89PNG and more")
    assert main([str(tmp_path / "picture.mcap")]) == 2
    assert capsys.readouterr().err == f"error: {tmp_path / 'picture.mcap'}: not an MCAP file\n"


def test_flight_that_is_still_recorded(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with BagWriter(tmp_path / "run/bag", {CONFIG_ATTACHMENT: SCENARIO.effective_yaml}) as writer:
        for arguments in ([str(tmp_path / "run")], [str(DATA / "short_flight"), str(writer.file)]):
            assert main(arguments) == 2
            assert capsys.readouterr().err == (
                f"error: {writer.file}: the flight is not over: its recorder has the bag open; "
                "try again when it has ended\n"
            )
    assert main([str(tmp_path / "run")]) == 2
    assert "no flight in it" in capsys.readouterr().err


@pytest.mark.parametrize("content", ["{", '{"outcome": "won"}'])
def test_summary_that_cannot_be_used(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: str
) -> None:
    write_bag(tmp_path / "run/bag")
    (tmp_path / "run/summary.json").write_text(content)
    assert main([str(tmp_path / "run")]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"error: {tmp_path / 'run/summary.json'}: ")
    assert error.count("\n") == 1


def test_two_recorded_flights_beside_each_other(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    short = write_bag(tmp_path / "short/bag").parent.parent
    comparison = tmp_path / "comparison.json"
    assert main([str(DATA / "short_flight"), str(DATA / "older_flight"), "--json", str(comparison)]) == 0
    content = json.loads(comparison.read_text())
    assert {row["section"] for row in content["configuration"]} == {"software"}
    assert not content["equal"]
    assert "older_flight" in content["not_comparable"][-1]
    rows = {row["label"]: row["values"] for row in content["results"]}
    assert rows["control steps that fell back"] == [0.0, 0.0]
    assert 0.01 < rows["formation error, steady, mean"][0] < 0.2

    assert main([str(DATA / "short_flight"), str(short)]) == 0
    out = capsys.readouterr().out
    assert "Results from 0.00 to 1.45 s" in out
    assert "- short_flight after 1.45 s: not every flight lasted longer." in out
    assert "- Not recorded in short: Rotor speed, mean; " in out


def test_replay_beside_its_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recorded, kept = DATA / "short_flight", tmp_path / "replayed"
    weight = "controller.weights.torque_per_n2_m2=20"
    assert replay([str(recorded), "--set", weight, "--out", str(kept)]) == 1
    arguments = ["--json", str(tmp_path / "comparison.json"), "--out", str(tmp_path / "comparison.html")]
    assert main([str(recorded), str(kept), *arguments]) == 0
    content = json.loads((tmp_path / "comparison.json").read_text())
    keys = {row["key"]: row["values"][1] for row in content["configuration"]}
    assert keys == {"controller.weights.torque_per_n2_m2": "20", "software": "not recorded"}
    rows = {row["label"]: row["values"] for row in content["results"]}
    truth = rows["formation error, mean of all"]
    assert truth[0] == pytest.approx(truth[1], rel=1e-6)
    speeds = rows["rotor speed, standard deviation"]
    assert abs(speeds[1] - speeds[0]) > 1.0
    capsys.readouterr()
    assert main([str(kept), "--no-figures"]) == 0
    assert capsys.readouterr().out == f"{kept / 'report.html'}\n"


def test_comparison_with_an_empty_bag(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    empty = tmp_path / "empty.mcap"
    empty.touch()
    assert main([str(DATA / "short_flight"), str(empty)]) == 2
    assert capsys.readouterr().err == f"error: {empty}: not an MCAP file: it is empty\n"
    with BagWriter(tmp_path / "bag", {CONFIG_ATTACHMENT: SCENARIO.effective_yaml}) as writer:
        pass
    assert main([str(DATA / "short_flight"), str(tmp_path / "bag")]) == 2
    assert capsys.readouterr().err == (
        f"error: {writer.file}: no flight in it: there is no message on /leader/ground_truth\n"
    )
