"""Flights over ROS whose first measurements are lost."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticStatus

from relform_analysis.flight.from_bag import read_flight_log
from relform_analysis.flight.simulate import fly_in_process
from relform_analysis.replay.command import EQUAL
from relform_analysis.replay.command import main as replay
from relform_bags.from_bag import decode
from relform_bags.reader import BagMessage, read_bag
from relform_core.load import load_scenario
from relform_core.names import CONTROLLER_NODE, DIAGNOSTICS, vehicle_node
from support.nodes import short
from support.scenarios import PAPER

FLY = Path(__file__).parents[2] / "scripts/fly.py"
FROM_ANYWHERE = (
    "controller=team",
    "start.follower_yaw_max_deg=180",
    "start.follower_offset_max_m=0.3",
    "seed=3",
)
"""Overrides: the team estimator, with unknown yaws."""


def dropout(probability: float) -> str:
    """Override: range and bearing of every vehicle are lost at random."""
    losses = [
        "{kind: dropout, sensor: range_bearing, start_s: 0.0, end_s: 100.0, "
        f"target: {vehicle}, probability: {probability}}}"
        for vehicle in ("leader", "follower_1", "follower_2")
    ]
    return f"events=[{', '.join(losses)}]"


def fly(folder: Path, *overrides: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(FLY), "--scenario", str(PAPER), "--out", str(folder)]
    for override in overrides:
        command += ["--set", override]
    environment = {name: value for name, value in os.environ.items() if name != "ROS_DOMAIN_ID"}
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=100, check=False)


def diagnostics_of(node: str, run: Path) -> list[DiagnosticStatus]:
    """What a node said, once a second."""
    return [
        status
        for entry in read_bag(run, {DIAGNOSTICS})
        if isinstance(entry, BagMessage)
        for status in decode(entry).status
        if status.name == node
    ]


@pytest.mark.parametrize("overrides", [(), FROM_ANYWHERE], ids=["raw", "team_from_anywhere"])
def test_a_late_start_is_the_same_flight_with_ros_without_and_replayed(
    tmp_path: Path, overrides: tuple[str, ...]
) -> None:
    folder = tmp_path / "run"
    flown = fly(folder, short(2.0), dropout(0.5), *overrides)
    assert flown.returncode == 0, flown.stderr
    log = read_flight_log(folder)
    expected = fly_in_process(load_scenario(folder / "config.yaml"))
    assert log.tick_of_step[0] == expected.tick_of_step[0] > 0
    assert log.p_NB_N.tobytes() == expected.p_NB_N.tobytes()
    assert log.rotor_speeds.tobytes() == expected.rotor_speeds.tobytes()
    assert log.pair_covariance.tobytes() == expected.pair_covariance.tobytes()
    assert log.leader_covariance.tobytes() == expected.leader_covariance.tobytes()
    for name, values in expected.estimator.items():
        assert log.estimator[name].tobytes() == values.tobytes(), name
    first, *_, last = diagnostics_of(CONTROLLER_NODE, folder)
    assert first.level == DiagnosticStatus.STALE
    assert "range and bearing" in first.message
    assert last.level == DiagnosticStatus.OK
    hovers, *_, flies = diagnostics_of(vehicle_node("leader"), folder)[1:]
    assert hovers.level == DiagnosticStatus.STALE
    assert flies.level == DiagnosticStatus.OK
    told = {entry.key: entry.value for entry in last.values}
    assert told["estimator.mode"] in ("measured", "predicted")
    assert (told["estimator.nis_dof"] == "0") is (not overrides)  # only the team estimator has innovations
    assert 0 <= int(told["estimator.rejected"]) < 10
    assert replay([str(folder)]) == EQUAL


def test_a_flight_that_cannot_start_says_what_it_waits_for_and_ends(tmp_path: Path) -> None:
    flown = fly(tmp_path / "run", short(60.0), dropout(1.0), "controller.start_wait_max_s=20.0")
    assert flown.returncode != 0
    assert "waits for range and bearing from leader to follower_1" in flown.stdout
    last = flown.stderr.splitlines()[-1]
    assert (
        "the flight cannot start: after 20 s (controller.start_wait_max_s) there is still no range and"
        in last
    )
