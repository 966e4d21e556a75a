"""Flights of larger teams in generated shapes, with complete and sparse sensing graphs."""

import pytest

from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.simulate import fly_in_process
from relform_core.load import load_scenario
from support.scenarios import CONFIG_FOLDER

SHORT = (
    "phases=["
    "{name: P, title: bend, duration_s: 2.5, steady_from_s: 1.5, formation: initial, "
    "motion: {kind: turn, angle_deg: 40.0, turn_s: 1.0}}, "
    "{name: Q, title: wide, duration_s: 3.0, steady_from_s: 2.2, formation: wide, "
    "motion: {kind: straight, speed_m_s: 1.0, ramp_s: 0.8}}]"
)
"""Override: a turn on the spot, then a change of formation while the team speeds up."""


@pytest.mark.parametrize(
    ("name", "changes"),
    [("twelve", ()), ("twelve", ("sensing={kind: nearest, count: 3}",)), ("eight_ring", ())],
    ids=["complete", "nearest", "ring"],
)
def test_a_turn_and_a_change_of_formation(name: str, changes: tuple[str, ...]) -> None:
    scenario = load_scenario(CONFIG_FOLDER / f"scenarios/{name}.yaml", (SHORT, *changes), seed=4)
    log = fly_in_process(scenario)
    metrics = flight_metrics(log)
    assert not log.faults
    assert metrics.score.formation.steady.mean < 0.02
    assert metrics.score.leader_position.steady.mean < 0.05
    assert metrics.separation_min > scenario.config.vehicle.separation_min
    assert metrics.solver.fallback_steps == 0
