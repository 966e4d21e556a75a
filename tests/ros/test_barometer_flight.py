"""A registered sensor travels through a flight over ROS into its bag and into the replay."""

import subprocess
import sys
from pathlib import Path

import pytest

from relform_analysis.replay.from_bag import read_recorded_flight
from relform_analysis.replay.replay import RecordedFlight, replay
from relform_bags.reader import BagMessage, find_bag, read_bag
from relform_core.measurements import TeamMeasurements
from relform_core.sensors.barometer import BAROMETER
from support.flights import record
from support.nodes import short
from support.scenarios import PAPER, WITH_BAROMETER, paper_scenario

FLY = Path(__file__).parents[2] / "scripts/fly.py"
DROPPED = range(4, 8)
OVERRIDES = (
    short(0.5),
    WITH_BAROMETER,
    "events=[{kind: dropout, sensor: barometer, target: follower_1, start_s: 0.2, end_s: 0.4, "
    "probability: 1}]",
)
STEPS = 10
SEED = 3
VEHICLES = ("leader", "follower_1", "follower_2")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("barometer") / "run"
    command = [sys.executable, str(FLY), "--scenario", str(PAPER), "--seed", str(SEED), "--out", str(folder)]
    for override in OVERRIDES:
        command += ["--set", override]
    subprocess.run(command, check=True, capture_output=True, timeout=100.0)
    return folder


@pytest.fixture(scope="module")
def recorded(run: Path) -> RecordedFlight:
    return read_recorded_flight(run)


@pytest.fixture(scope="module")
def in_process() -> list[TeamMeasurements]:
    measurements, _ = record(paper_scenario(*OVERRIDES, seed=SEED), STEPS)
    return measurements


def test_bag_holds_the_messages_that_were_not_dropped(run: Path) -> None:
    messages = [
        (entry.topic, entry.type_name)
        for entry in read_bag(find_bag(run))
        if isinstance(entry, BagMessage) and entry.topic.endswith("/barometer")
    ]
    assert {type_name for _, type_name in messages} == {"sensor_msgs/msg/FluidPressure"}
    counts = {vehicle: messages.count((f"/{vehicle}/barometer", messages[0][1])) for vehicle in VEHICLES}
    everything = STEPS + 1  # the last step measures, but decides nothing
    assert counts == {"leader": everything, "follower_1": everything - len(DROPPED), "follower_2": everything}


def test_replay_gets_what_a_flight_in_one_process_measures(
    recorded: RecordedFlight, in_process: list[TeamMeasurements]
) -> None:
    assert len(recorded.steps) == STEPS
    for step, expected in zip(recorded.steps, in_process, strict=True):
        for vehicle in VEHICLES:
            arrived = step.measurements.by_vehicle[vehicle].arrived(BAROMETER)
            assert arrived == expected.by_vehicle[vehicle].arrived(BAROMETER)
            is_dropped = vehicle == "follower_1" and step.measurements.step in DROPPED
            assert len(arrived) == (0 if is_dropped else 1)


def test_replayed_decisions_are_the_recorded_ones(recorded: RecordedFlight) -> None:
    assert replay(recorded, recorded.scenario).identical
