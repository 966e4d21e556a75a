"""Flights from bags that are not what they should be: one line that names the bag and what is wrong."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Vector3
from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message
from std_msgs.msg import Header

from relform_analysis.flight.from_bag import read_flight_log
from relform_bags.writer import BagWriter
from relform_core.errors import BagError
from relform_core.names import CONFIG_ATTACHMENT
from relform_msgs.msg import FormationReference, RelativePosition
from support.scenarios import paper_scenario

SCENARIO = paper_scenario(seed=11)
VEHICLES = SCENARIO.config.team.vehicles
REFERENCE = "/formation/reference"
TYPES = {REFERENCE: "relform_msgs/msg/FormationReference"} | {
    f"/{vehicle}/ground_truth": "nav_msgs/msg/Odometry" for vehicle in VEHICLES
}
STEPS = 40


def header(step: int) -> Header:
    return Header(stamp=Time(sec=step // 20, nanosec=step % 20 * 50_000_000))


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
    odometry = Odometry(header=header(step))
    odometry.pose.pose.position.z = 2.0 + step
    odometry.twist.twist.linear.x = 1.5
    return odometry


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


def test_what_there_is_of_a_bag_that_was_cut_off(tmp_path: Path) -> None:
    writer = write(tmp_path / "bag")
    content = writer.file.read_bytes()  # the recorder was killed here
    for share in (0.95, 0.7):
        (tmp_path / "cut.mcap").write_bytes(content[: round(share * len(content))])
        log = read_flight_log(tmp_path / "cut.mcap")
        assert 0 < len(log.phase) < STEPS
        np.testing.assert_array_equal(log.p_NB_N[:, 0, 2], 2.0 + np.arange(len(log.tick_ns)))


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
    assert (
        error_of(tmp_path / "bag") == f"{writer.file}: not a bag of relform: it has no attachment config.yaml"
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("name: [", "its attachment config.yaml:1: not valid YAML"),
        (SCENARIO.effective_yaml.replace("mass_kg", "weight_kg"), "vehicle.mass_kg: missing key"),
    ],
)
def test_configuration_that_does_not_fit(tmp_path: Path, text: str, expected: str) -> None:
    writer = write(tmp_path / "bag", attachment=text)
    writer.close()
    error = error_of(tmp_path / "bag")
    assert error.startswith(f"{writer.file}: its attachment config.yaml")
    assert expected in error


def test_file_that_is_no_bag(tmp_path: Path) -> None:
    path = tmp_path / "bag_0.mcap"
    path.write_text("something else")
    assert error_of(path) == f"{path}: not an MCAP file"
    assert error_of(tmp_path / "nowhere") == f"{tmp_path / 'nowhere'}: no such file or folder"
