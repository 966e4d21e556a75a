"""Flights of other vehicles and teams than the paper's, with one tuning."""

import pytest

from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.simulate import fly_in_process
from relform_core.load import load_scenario
from support.scenarios import CONFIG_FOLDER, paper_scenario

TEAM = "controller=team"


@pytest.mark.parametrize("key", ["vehicle", "plant"], ids=["configured", "to_be_found"])
def test_rotors_with_a_lag_of_one_control_period(key: str) -> None:
    """A controller that does not know of it crashes."""
    log = fly_in_process(paper_scenario(TEAM, f"{key}.rotor_time_constant_s=0.05", seed=11))
    assert not log.faults
    assert flight_metrics(log).score.formation.steady.mean < 0.012  # without lag: 0.008


def test_crazyflies() -> None:
    """A twentieth of the mass, and a lag of 50 ms."""
    log = fly_in_process(paper_scenario(TEAM, "vehicle=crazyflie", seed=12))
    assert not log.faults
    assert flight_metrics(log).score.formation.steady.mean < 0.012
    assert flight_metrics(log).rotors.saturated_fraction < 0.02


def test_a_team_of_five() -> None:
    log = fly_in_process(load_scenario(CONFIG_FOLDER / "scenarios/five.yaml", (), 13))
    metrics = flight_metrics(log)
    assert not log.faults
    assert metrics.score.formation.steady.mean < 0.011
    assert metrics.score.leader_position.steady.mean < 0.05
    assert metrics.rotors.saturated_fraction < 0.02
