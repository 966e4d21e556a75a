"""The solver seam: one SQP step of the team's problem, prepared before the measurement, solved after it."""

from dataclasses import dataclass
from typing import Protocol

from relform_controller.ocp.problem import HorizonReference, HorizonStart, Plan, TeamGeometry
from relform_core.controller_config import WeightsConfig


class QpError(Exception):
    """A quadratic program has no usable solution; the text gives the reason."""


@dataclass(frozen=True, eq=False)
class SqpStep:
    """The outcome of one SQP step."""

    plan: Plan
    kkt: float
    """|gradient . step| + sum |multiplier * active bound| of the QP: the KKT value of ACADO, to which the
    paper's tolerances refer."""
    objective: float
    """Value of eqs. CostFunc1 and CostFunc2 at the new plan, in the Gauss-Newton model of the step."""
    qp_iterations: int
    active_bounds: int
    active_constraints: tuple[str, ...] = ()
    """Names of the soft constraints that are active at some stage."""


class Solver(Protocol):
    """Takes SQP steps of one optimal control problem: ``prepare``, then ``feedback``."""

    def set_weights(self, weights: WeightsConfig) -> None:
        """Change the weights of the cost; what was prepared is void."""

    def prepare(self, guess: Plan, geometry: TeamGeometry) -> None:
        """Do what can be done before the measurement.

        Args:
            guess: to linearise around.
            geometry: where the {mi} frames are predicted to be.
        Raises:
            QpError: the QP cannot be set up, for instance because the guess is not finite.
        """

    def feedback(self, start: HorizonStart, geometry: TeamGeometry, reference: HorizonReference) -> SqpStep:
        """Solve the prepared problem for one estimate.

        Args:
            start: the vehicles as they are estimated to be.
            geometry: where the {mi} frames are estimated to be.
            reference: what to track.
        Raises:
            QpError: the QP was not solved.
            RuntimeError: nothing was prepared.
        """
