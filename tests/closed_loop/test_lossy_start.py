"""Flights whose first measurements are lost: the vehicles hover until the controller can start."""

import numpy as np
import pytest

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.simulate import fly_in_process, simulate
from relform_analysis.flight.summary import Outcome
from relform_analysis.report.flight_source import ending_from_log
from relform_core.errors import FlightError
from support.flights import AGILE
from support.scenarios import paper_scenario, team_of

TEAM = ("leader", "follower_1", "follower_2", "follower_3")


def dropout(probability: float, end_s: float, n_vehicles: int) -> str:
    """Override: range and bearing of every vehicle are lost at random."""
    losses = [
        f"{{kind: dropout, sensor: range_bearing, start_s: 0.0, end_s: {end_s}, target: {vehicle}, "
        f"probability: {probability}}}"
        for vehicle in TEAM[:n_vehicles]
    ]
    return f"events=[{', '.join(losses)}]"


def start_of(log: FlightLog) -> int:
    """The step of the first command."""
    return int(log.tick_of_step[0])


@pytest.mark.parametrize(("n_vehicles", "seed"), [(3, 0), (3, 1), (3, 2), (4, 3)])
def test_half_of_all_range_and_bearing_may_be_lost_from_the_first_step_on(n_vehicles: int, seed: int) -> None:
    scenario = paper_scenario(*team_of(n_vehicles), AGILE, dropout(0.5, 100.0, n_vehicles), seed=seed)
    log = fly_in_process(scenario)
    assert not log.faults
    assert 0 < start_of(log) < 20
    metrics = flight_metrics(log)
    assert [phase.steps for phase in metrics.phases] == [
        20,
        30 - start_of(log),
    ]  # the end of the flight stays
    assert metrics.phases[0].score.formation.all.mean < 0.12  # before the formation changes
    assert metrics.solver.fallback_steps == 0


def test_while_the_controller_waits_the_vehicles_hold_height_and_position() -> None:
    scenario = paper_scenario(AGILE, dropout(1.0, 2.0, 3), "vehicle.mass_std_percent=0", seed=5)
    log = fly_in_process(scenario)
    assert start_of(log) == 40
    hovered = log.p_NB_N[: start_of(log) + 1]
    assert np.abs(hovered - hovered[0]).max() < 0.15
    assert np.abs(log.v_NB_B[start_of(log)]).max() < 0.3
    assert not log.faults
    assert log.phase == ("P",) * 10
    np.testing.assert_array_equal(log.leader_p_NB_N__ref[0], [0.0, 0.0, 2.0])
    assert ending_from_log(log).outcome is Outcome.COMPLETED  # a late start is no early end


def test_a_flight_that_cannot_start_ends_with_what_is_missing() -> None:
    scenario = paper_scenario(AGILE, dropout(1.0, 100.0, 3), "controller.start_wait_max_s=1.0")
    steps = []
    with pytest.raises(FlightError, match=r"after 1 s .* no range and bearing from leader to follower_1, "):
        steps.extend(simulate(scenario))
    for number, step in enumerate(simulate(scenario)):
        assert step.decision is None
        if number == 19:
            break
