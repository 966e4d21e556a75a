"""Starts of the team estimator: in formation, and from anywhere with unknown yaws."""

from itertools import islice

import numpy as np
import pytest

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_analysis.flight.metrics import separation_min, tilts
from relform_analysis.flight.simulate import add_step, simulate
from relform_analysis.flight.tracking_errors import follower_yaw_errors, formation_errors, scored_pairs
from relform_core.arrays import Array
from relform_core.errors import FlightError
from support.flights import seconds
from support.formations import as_yaml, line_astern
from support.scenarios import CONFIG_FOLDER, paper_scenario

TEAM = f"controller={CONFIG_FOLDER / 'controller/team.yaml'}"
ANYWHERE = ("start.follower_yaw_max_deg=180", "start.follower_offset_max_m=0.3")


def fly(*overrides: str, seed: int, time: float) -> FlightLog:
    scenario = paper_scenario(TEAM, *overrides, seed=seed)
    log = FlightLogBuilder(scenario)
    for step in islice(simulate(scenario), seconds(scenario, time)):
        add_step(log, step)
    return log.build()


def errors(log: FlightLog) -> Array:
    """Largest formation error of all pairs at each step [m]."""
    worst: Array = formation_errors(log, scored_pairs(log.scenario.config.team)).max(axis=1)
    return worst


def assert_calm_and_settled(log: FlightLog) -> None:
    """At most 25 deg of tilt and 0.5 m between vehicles at all times; in formation after 3 s."""
    assert not log.faults
    assert np.degrees(tilts(log.q_NB)).max() < 25.0
    assert separation_min(log.p_NB_N) > 0.5
    settled = log.step_ns >= 3_000_000_000
    assert settled.sum() >= 15
    assert errors(log)[settled].max() < 0.05
    assert np.degrees(follower_yaw_errors(log))[settled].max() < 5.0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_start_from_unknown_yaws(seed: int) -> None:
    log = fly(*ANYWHERE, seed=seed, time=4.0)
    assert errors(log)[0] > 0.1
    assert np.degrees(follower_yaw_errors(log)[0]).max() > 10.0
    assert_calm_and_settled(log)


def test_a_start_along_a_chain_of_sightings() -> None:
    """Each of four vehicles in a line sees its neighbours only."""
    line = as_yaml(line_astern(4))
    log = fly(
        "team.followers=[follower_1, follower_2, follower_3]",
        f"formations_m={{initial: {line}, wide: {line}}}",
        "sensors.range_bearing.range_max_m=1.9",
        "start.follower_yaw_max_deg=180",
        "start.follower_offset_max_m=0.2",
        seed=4,
        time=4.0,
    )
    assert_calm_and_settled(log)


def test_a_start_in_formation_is_no_disturbance() -> None:
    """The noise of the first estimates does not become motion; the peak is that of the first second."""
    logs = [fly(seed=seed, time=1.2) for seed in range(5)]
    assert np.mean([errors(log).max() for log in logs]) < 0.02
    for log in logs:
        held = log.step_ns < 200_000_000
        assert held.sum() == 4
        assert errors(log)[held].max() < 0.005


@pytest.mark.parametrize(
    ("position_std_m", "missing"),
    [
        (0.2, r"accurate relative yaw of follower_\d \(known to \d\.\d deg, 3 deg are needed\)"),
        (1.0, r"accurate relative yaw of follower_\d \(known to \d\d\.\d deg, 20 deg are needed\)"),
    ],
    ids=["held", "hovering"],
)
def test_a_start_whose_yaws_stay_unknown_ends_with_the_reason(position_std_m: float, missing: str) -> None:
    sensors = f"sensors.range_bearing.position_std_m={position_std_m}"
    message = rf"the flight cannot start: after 0\.5 s .* there is still no {missing}$"
    with pytest.raises(FlightError, match=message):
        fly(*ANYWHERE, sensors, "controller.start_wait_max_s=0.5", seed=6, time=4.0)
