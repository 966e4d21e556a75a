"""Whether the team estimator knows its errors: errors of its belief beside their covariance, by state."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from relform_analysis.flight.simulate import simulate
from relform_analysis.judges.flown import true_state
from relform_controller.blas import one_blas_thread
from relform_controller.estimation.team import TeamEstimator
from relform_controller.estimation.team_belief import Belief
from relform_controller.formation_controller import FormationController
from relform_controller.ocp import layout
from relform_controller.ocp.frames import wrap_angles
from relform_core.arrays import Array
from relform_core.load import LoadedScenario
from relform_core.telemetry import EstimatorReport

STATES: Mapping[str, tuple[int, ...]] = {
    name: tuple(range(layout.N_STATE)[part])
    for name, part in {
        "position": layout.POSITION,
        "velocity": layout.VELOCITY,
        "yaw": slice(layout.YAW, layout.YAW + 1),
    }.items()
}
"""Components of each judged state."""


@dataclass(frozen=True, eq=False)
class JudgedStep:
    """One control step with an estimate."""

    time: float
    """[s]"""
    nees: Mapping[str, Array]
    """Normalised estimation error squared per degree of freedom, of each follower relative to the leader in
    {n}, by state; shape (follower,). Its mean is 1 if the covariances are right."""
    report: EstimatorReport


def judged_steps(scenario: LoadedScenario) -> Iterator[JudgedStep]:
    """Fly a scenario with the team estimator and judge every estimate by the true states.

    Raises:
        FlightError: the flight cannot start.
    """
    estimator = TeamEstimator(scenario.config)
    controller = FormationController(scenario.config, estimator=estimator)
    with one_blas_thread():
        for step in simulate(scenario, controller=controller):
            if step.decision is None or estimator.belief is None or step.decision.state.estimator is None:
                continue
            truth = np.array([true_state(odometry) for odometry in step.ground_truth.values()])
            time = step.measurements.step * scenario.config.controller.period
            nees = relative_nees(estimator.belief, truth)
            yield JudgedStep(time, nees, step.decision.state.estimator)


def relative_nees(belief: Belief, truth: Array) -> dict[str, Array]:
    """The errors of a belief, see ``JudgedStep.nees``; the true states are those of ``team_model``."""
    errors = belief.states - truth
    errors[:, layout.YAW] = wrap_angles(errors[:, layout.YAW])
    rows = belief.factor.reshape(*truth.shape, -1)
    nees = {}
    for name, components in STATES.items():
        error = (errors[1:] - errors[0])[:, components]
        factor = (rows[1:] - rows[0])[:, components]
        solved = np.linalg.solve(factor @ factor.swapaxes(1, 2), error[:, :, None])[:, :, 0]
        nees[name] = (error * solved).sum(axis=1) / len(components)
    return nees
