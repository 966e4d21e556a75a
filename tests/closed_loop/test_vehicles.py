"""Flights of other vehicles than the paper's, with the tuning of the paper's."""

from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.simulate import fly_in_process
from support.scenarios import paper_scenario

TEAM = "controller.estimator=team"


def test_rotors_with_a_lag_of_one_control_period() -> None:
    """It is known to filter and prediction; a controller that does not know of it crashes."""
    log = fly_in_process(paper_scenario(TEAM, "vehicle.rotor_time_constant_s=0.05", seed=11))
    assert not log.faults
    assert flight_metrics(log).score.formation.steady.mean < 0.012  # without lag: 0.008
