"""Short flights of the leader's paths with the team estimator."""

import math

import pytest

from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.simulate import fly_in_process
from relform_core.load import load_scenario
from support.scenarios import CONFIG_FOLDER


def test_team_circles_a_tower_and_looks_at_it() -> None:
    """The whole scenario: the leader flies sideways for most of the time."""
    log = fly_in_process(load_scenario(CONFIG_FOLDER / "scenarios/tower.yaml", seed=4))
    metrics = flight_metrics(log)
    assert not log.faults
    assert metrics.solver.fallback_steps == 0
    assert metrics.score.formation.steady.mean < 0.03
    assert metrics.score.leader_position.steady.mean < 0.08
    assert metrics.score.leader_yaw.steady.mean < math.radians(3.0)


@pytest.mark.parametrize(
    ("name", "phase"),
    [
        ("circle", "motion: {kind: circle, radius_m: -1.0, speed_m_s: 1.5, ramp_s: 1.0}, duration_s: 5.5"),
        (
            "figure_eight",
            "motion: {kind: figure_eight, radius_m: 0.6, speed_m_s: 1.5, ramp_s: 1.0}, duration_s: 7.5",
        ),
        (
            "waypoints",
            "motion: {kind: waypoints, points_m: [[3, 0, 0.5], [3, 2, 1], [1, 3, 0.5]], speed_m_s: 1.5, "
            "ramp_s: 1.2}, duration_s: 6.5",
        ),
    ],
)
def test_team_follows_the_path(name: str, phase: str) -> None:
    """One phase from rest to rest, with a start 25 degrees off the axes."""
    phases = f"phases=[{{name: P, title: path, steady_from_s: 0.5, formation: initial, {phase}}}]"
    path = CONFIG_FOLDER / f"scenarios/{name}.yaml"
    log = fly_in_process(load_scenario(path, (phases, "start.yaw_deg=25"), seed=4))
    metrics = flight_metrics(log)
    assert not log.faults
    assert metrics.solver.fallback_steps == 0
    assert metrics.score.formation.steady.mean < 0.03
    assert metrics.score.leader_position.steady.mean < 0.08
