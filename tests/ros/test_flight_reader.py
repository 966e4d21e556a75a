"""Flight logs from bags: decoding, configuration, and one-line errors for unusable bags."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Vector3
from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message
from std_msgs.msg import Header

from relform_analysis.flight.from_bag import message_takers, read_flight_log
from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_analysis.replay.from_bag import read_recorded_flight
from relform_bags.info import read_information
from relform_bags.reader import find_bag, read_attachments, read_bag
from relform_bags.writer import BagWriter
from relform_core.errors import BagError
from relform_core.names import CONFIG_ATTACHMENT
from relform_core.roster import Controller
from relform_core.telemetry import Event, FaultReported, PerStep
from relform_msgs.msg import FormationReference, RelativePosition
from relform_ros.commands import rotor_command_to_msg
from relform_ros.events import event_to_msg
from relform_ros.odometry import odometry_to_msg
from relform_ros.telemetry import reference_to_msg, solver_to_msg, state_to_msg
from support.examples import example
from support.logs import decision, odometry
from support.scenarios import paper_scenario

SCENARIO = paper_scenario(seed=11)
VEHICLES = SCENARIO.config.team.vehicles
REFERENCE = "/formation/reference"
TYPES = {REFERENCE: "relform_msgs/msg/FormationReference"} | {
    f"/{vehicle}/ground_truth": "nav_msgs/msg/Odometry" for vehicle in VEHICLES
}
STEPS = 40
SHORT_FLIGHT = Path(__file__).parents[1] / "data/short_flight"


def header(step: int) -> Header:
    return Header(stamp=Time(sec=step // 20, nanosec=step % 20 * 50_000_000), frame_id="map")


def message(topic: str, step: int) -> Any:
    if topic == REFERENCE:
        return FormationReference(
            header=header(step),
            step=step,
            phase="A",
            leader_position=Point(x=1.0, y=2.0, z=3.0),
            leader_yaw=0.5,
            formation=[
                RelativePosition(observer_id="leader", target_id="follower_1", position=Vector3(x=-1.5))
            ],
        )
    state = Odometry(header=header(step), child_frame_id=f"{topic.split('/')[1]}/base_link")
    state.pose.pose.position.z = 2.0 + step
    state.twist.twist.linear.x = 1.5
    return state


def write(folder: Path, without: str = "", attachment: str | None = SCENARIO.effective_yaml) -> BagWriter:
    """A small flight; the writer is still open, all but the last message are safe."""
    writer = BagWriter(folder, {} if attachment is None else {CONFIG_ATTACHMENT: attachment})
    topics = {topic: type_name for topic, type_name in TYPES.items() if topic != without}
    for topic, type_name in topics.items():
        writer.add_topic(topic, type_name, [])
    for step in range(STEPS):
        for topic in topics:
            data = serialize_message(message(topic, step))
            writer.write(topic, data, 50_000_000 * step, 0)
        if step % 3 == 0:
            writer.flush()
    return writer


def test_a_small_flight(tmp_path: Path) -> None:
    write(tmp_path / "run/bag").close()
    log = read_flight_log(tmp_path / "run")
    assert (log.scenario.config, log.scenario.seed) == (SCENARIO.config, 11)
    assert log.step_ns.tolist() == [50_000_000 * step for step in range(STEPS)]
    np.testing.assert_array_equal(log.p_NB_N[:, 2, 2], 2.0 + np.arange(STEPS))
    np.testing.assert_array_equal(log.p_BB_C__ref[7, 0, 1], [-1.5, 0.0, 0.0])
    assert np.isnan(log.rotor_speeds).all()


def test_log_of_a_bag_that_was_cut_off(tmp_path: Path) -> None:
    writer = write(tmp_path / "bag")
    content = writer.file.read_bytes()  # the recorder was killed here
    for share in (0.95, 0.7):
        (tmp_path / "cut.mcap").write_bytes(content[: round(share * len(content))])
        log = read_flight_log(tmp_path / "cut.mcap")
        assert 0 < len(log.phase) < STEPS
        np.testing.assert_array_equal(log.p_NB_N[:, 0, 2], 2.0 + np.arange(len(log.tick_ns)))


def test_messages_and_core_types_make_the_same_log() -> None:
    from_core, from_messages = (FlightLogBuilder(SCENARIO) for _ in range(2))
    team = SCENARIO.config.team
    takers = message_takers(from_messages, SCENARIO.config)
    for step in range(3):
        stamp_ns = 3_000_000_000 + step * 50_000_000
        for vehicle, yaw_deg in (("leader", 10.0), ("follower_1", -50.0), ("follower_2", 170.0)):
            state = odometry(stamp_ns, (1.0, -2.0, 3.0), yaw_deg)
            from_core.add_ground_truth(vehicle, state)
            takers[f"/{vehicle}/ground_truth"](odometry_to_msg(state, vehicle))
        decided = decision(stamp_ns)
        from_core.add_decision(decided)
        takers[REFERENCE](reference_to_msg(PerStep(step, stamp_ns, decided.reference)))
        takers["/formation/state"](state_to_msg(PerStep(step, stamp_ns, decided.state)))
        takers["/formation/solver"](solver_to_msg(PerStep(step, stamp_ns, decided.solver)))
        for vehicle, command in decided.commands.items():
            takers[f"/{vehicle}/rotor_speeds"](rotor_command_to_msg(command, vehicle))
    event = PerStep(3, 3_150_000_000, Event("follower_1", FaultReported("touches the ground")))
    from_core.add_event(event)
    takers["/formation/events"](event_to_msg(event, team))
    expected, log = from_core.build(), from_messages.build()
    assert log.phase == expected.phase == ("A", "A", "A")
    assert log.faults == expected.faults != ()
    for name, array in vars(expected).items():
        if isinstance(array, np.ndarray):
            np.testing.assert_array_equal(getattr(log, name), array, err_msg=name)
    for name, values in expected.solver.items():
        np.testing.assert_array_equal(log.solver[name], values, err_msg=name)


def test_log_of_another_controller_comes_from_its_topics() -> None:
    builder = FlightLogBuilder(SCENARIO)
    takers = message_takers(builder, SCENARIO.config, Controller("escort", ("follower_1",)))
    assert {"/escort/reference", "/escort/state", "/escort/solver", "/escort/events"} <= takers.keys()
    assert not [topic for topic in takers if topic.startswith("/formation/")]
    for vehicle in VEHICLES:
        builder.add_ground_truth(vehicle, odometry(0, (1.0, -2.0, 3.0), 10.0))
    takers["/escort/reference"](reference_to_msg(PerStep(0, 0, decision(0, "B").reference)))
    assert builder.build().phase == ("B",)


def test_what_cannot_be_used_is_left_out_as_the_nodes_did(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(tmp_path / "whole").close()
    writer = write(tmp_path / "bag")
    strange = message(REFERENCE, STEPS)
    strange.formation[0].target_id = "stranger"
    writer.write(REFERENCE, serialize_message(strange), 50_000_000 * STEPS, 0)
    second = message(REFERENCE, 1)
    second.leader_position.x += 1.0
    writer.write(REFERENCE, serialize_message(second), 50_000_000 * STEPS, 0)
    writer.write(REFERENCE, serialize_message(second)[:50], 50_000_000 * STEPS, 0)
    writer.close()
    log = read_flight_log(tmp_path / "bag")
    assert capsys.readouterr().err == (
        f"{writer.file}: left out: 2 messages cannot be used, the last one on {REFERENCE}: 50 bytes cannot "
        "be decoded as FormationReference\n"
    )
    expected = read_flight_log(tmp_path / "whole")
    np.testing.assert_array_equal(log.leader_p_NB_N__ref, expected.leader_p_NB_N__ref)


def test_why_nothing_can_be_used_is_one_line(tmp_path: Path) -> None:
    writer = write(tmp_path / "bag", without=REFERENCE)
    writer.add_topic(REFERENCE, TYPES[REFERENCE], [])
    strange = message(REFERENCE, 0)
    strange.formation[0].target_id = "stranger"
    writer.write(REFERENCE, serialize_message(strange), 0, 0)
    writer.close()
    error = error_of(tmp_path / "bag")
    assert error.startswith(
        f"{writer.file}: no flight in it: there is no message on {REFERENCE}; 1 messages "
    )
    assert "stranger" in error


def error_of(path: Path) -> str:
    with pytest.raises(BagError) as failure:
        read_flight_log(path)
    assert "\n" not in str(failure.value)
    return str(failure.value)


@pytest.mark.parametrize("topic", TYPES)
def test_topic_that_is_missing(tmp_path: Path, topic: str) -> None:
    writer = write(tmp_path / "bag", without=topic)
    writer.close()
    assert error_of(tmp_path / "bag") == f"{writer.file}: no flight in it: there is no message on {topic}"


def test_bag_from_elsewhere(tmp_path: Path) -> None:
    writer = write(tmp_path / "bag", attachment=None)
    writer.close()
    assert error_of(tmp_path / "bag").startswith(
        f"{writer.file}: no configuration of the flight: the bag has no attachment config.yaml"
    )


def test_configuration_of_a_bag_without_attachment(tmp_path: Path) -> None:
    write(tmp_path / "run/bag", attachment=None).close()
    given = tmp_path / "given.yaml"
    given.write_text(SCENARIO.effective_yaml.replace("seed: 11", "seed: 12"))
    assert read_flight_log(tmp_path / "run/bag", given).scenario.seed == 12
    for file, seed in ((tmp_path / "run/config.yaml", 13), (tmp_path / "run/bag/config.yaml", 14)):
        file.write_text(SCENARIO.effective_yaml.replace("seed: 11", f"seed: {seed}"))
        log = read_flight_log(tmp_path / "run")
        assert (log.scenario.seed, len(log.phase)) == (seed, STEPS)
    file.write_text("name: [")
    assert error_of(tmp_path / "run").startswith(f"{file}:1:8: not valid YAML")


def test_given_configuration_comes_before_the_attachment(tmp_path: Path) -> None:
    write(tmp_path / "bag").close()
    given = tmp_path / "given.yaml"
    given.write_text(SCENARIO.effective_yaml.replace("seed: 11", "seed: 12"))
    assert read_flight_log(tmp_path / "bag", given).scenario.seed == 12
    assert read_flight_log(tmp_path / "bag").scenario.seed == 11


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("name: [", "its attachment config.yaml:1:8: not valid YAML"),
        (SCENARIO.effective_yaml.replace("mass_kg", "weight_kg"), "vehicle.mass_kg: missing key"),
    ],
)
def test_configuration_that_does_not_fit(tmp_path: Path, text: str, expected: str) -> None:
    writer = write(tmp_path / "bag", attachment=text)
    writer.close()
    error = error_of(tmp_path / "bag")
    assert error.startswith(f"{writer.file}: its attachment config.yaml")
    assert expected in error


def test_file_that_is_not_a_bag(tmp_path: Path) -> None:
    path = tmp_path / "bag_0.mcap"
    path.write_text("something else")
    assert error_of(path) == f"{path}: not an MCAP file"
    assert error_of(tmp_path / "nowhere") == f"{tmp_path / 'nowhere'}: no such file or folder"


@pytest.mark.parametrize(
    "read", [find_bag, read_attachments, read_information, lambda path: list(read_bag(path, [REFERENCE]))]
)
def test_a_text_names_a_bag_as_a_path_does(read: Any) -> None:
    assert read(str(SHORT_FLIGHT)) == read(SHORT_FLIGHT)


def test_example_reads_a_recording_that_a_text_names(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["read_recording.py", str(SHORT_FLIGHT)])
    log = example("read_recording").log
    assert capsys.readouterr().out.startswith(f"{len(log.vehicles)} vehicles, {log.step_ns[-1] / 1e9:.1f} s")
    assert len(read_recorded_flight(str(SHORT_FLIGHT)).steps) == len(log.phase)
