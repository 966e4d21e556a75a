"""The estimator seam: measurements of the team in, the start of the horizon out."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from relform_controller.ocp.problem import Prediction, TeamGeometry
from relform_core.arrays import Array
from relform_core.measurements import TeamMeasurements

_NAMED_MAX = 3
"""How many things a reason names."""


class EstimatorMode(StrEnum):
    """How the estimate of one control step came about."""

    MEASURED = "measured"
    """Everything that the estimator uses was measured in this step."""
    PREDICTED = "predicted"
    """Something was not measured, and a prediction stands in for it."""
    WAITING = "waiting"
    """There is no estimate yet, so the flight has not started."""


@dataclass(frozen=True, eq=False)
class TeamEstimate:
    """The team at one instant; the pairs are those of ``layout.ordered_pairs``."""

    states: Array
    """Shape (vehicle, N_STATE), each in its own {mi}: position and yaw are zero by definition."""
    geometry: TeamGeometry
    """Where the {mi} frames lie. The leader's yaw may be off by whole turns."""
    yaw_variances: Array
    """Of ``geometry.yaw_I1I2`` [rad^2], shape (pair,)."""
    yaw_held: tuple[bool, ...]
    """By pair: not measured in this step, propagated from the step before."""
    reason: str
    """What was not measured, for people; empty if everything was."""

    @property
    def mode(self) -> EstimatorMode:
        """How the estimate came about."""
        return EstimatorMode.PREDICTED if self.reason else EstimatorMode.MEASURED


@dataclass(frozen=True)
class Waiting:
    """There is no estimate yet."""

    reason: str
    """What is missing, for people."""

    @property
    def mode(self) -> EstimatorMode:
        """That it waits."""
        return EstimatorMode.WAITING


class Estimator(Protocol):
    """Turns the measurements of each control step into an estimate of the team."""

    @property
    def estimates_disturbances(self) -> bool:
        """Whether the geometry of every estimate has disturbances, for the prediction model."""

    def update(
        self, measurements: TeamMeasurements, applied_thrusts: Array, predicted: Prediction | None
    ) -> TeamEstimate | Waiting:
        """The estimate at the instant of one control step; called once per step, in order.

        Args:
            measurements: what arrived in this step.
            applied_thrusts: inputs of the interval that ends at this instant [N], shape (vehicle, N_INPUT).
            predicted: what the last plan predicts for this instant; None before the first plan. An estimator
                with a model of its own does not need it.
        Returns:
            The estimate, or what it waits for. After its first estimate it no longer waits.
        """


def listed(missing: Sequence[str]) -> str:
    """The first things that are missing, and how many more; empty if nothing is."""
    named = ", ".join(missing[:_NAMED_MAX])
    more = len(missing) - _NAMED_MAX
    return f"{named} and {more} more" if more > 0 else named
