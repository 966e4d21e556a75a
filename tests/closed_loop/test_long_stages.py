"""Flights with stages that are longer than the control period."""

import pytest

from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.simulate import fly_in_process
from support.flights import AGILE
from support.scenarios import paper_scenario


@pytest.mark.parametrize(("stage_s", "horizon_steps"), [(0.1, 8), (0.08, 9)])
def test_the_team_keeps_its_formation(stage_s: float, horizon_steps: int) -> None:
    overrides = (f"controller.stage_s={stage_s}", f"controller.horizon_steps={horizon_steps}")
    log, usual = (fly_in_process(paper_scenario(AGILE, *each, seed=6)) for each in (overrides, ()))
    assert not log.faults
    found, expected = flight_metrics(log), flight_metrics(usual)
    assert found.score.formation.all.mean < 1.3 * expected.score.formation.all.mean
    assert found.score.leader_position.all.mean < 1.3 * expected.score.leader_position.all.mean
    assert found.solver.fallback_steps == 0
    assert found.solver.sqp_steps_median <= 2
