"""A flight at 100 Hz beside one at 20 Hz, with the same horizon."""

from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.simulate import fly_in_process
from relform_core.load import load_scenario
from support.scenarios import CONFIG_FOLDER, paper_scenario

SHORT = (
    "phases=["
    "{name: P, title: line, duration_s: 2.5, steady_from_s: 1.0, formation: initial, "
    "motion: {kind: straight, speed_m_s: 2.0, ramp_s: 0.8}}, "
    "{name: Q, title: turn, duration_s: 1.5, steady_from_s: 0.5, formation: initial, "
    "motion: {kind: turn, angle_deg: 90.0, turn_s: 0.5}}]"
)


def test_a_faster_controller_is_more_accurate() -> None:
    logs = [
        fly_in_process(paper_scenario(SHORT, f"controller={name}", seed=6)) for name in ("team", "team_100hz")
    ]
    usual, fast = (flight_metrics(log) for log in logs)
    assert [len(log.solver["kkt"]) for log in logs] == [80, 400]
    assert not logs[1].faults
    assert fast.solver.fallback_steps == 0
    assert fast.score.formation.all.mean < 0.95 * usual.score.formation.all.mean
    assert fast.score.leader_position.all.mean < usual.score.leader_position.all.mean


def test_the_tuning_follows_the_length_of_a_stage() -> None:
    """So that both tunings stay one: sums over stages are integrals over time."""
    usual, fast = (
        load_scenario("paper", [f"controller={CONFIG_FOLDER / f'controller/{name}.yaml'}"]).config.controller
        for name in ("team", "team_100hz")
    )
    ratio = usual.stage_length / fast.stage_length
    scaled = usual.weights.model_copy(
        update={
            "terminal_scale": usual.weights.terminal_scale * ratio,
            "thrust_rate": usual.weights.thrust_rate * ratio**2,
        }
    )
    assert fast.weights == scaled
    assert fast.horizon == usual.horizon
    assert (fast.solver, fast.estimator) == (usual.solver, usual.estimator)
