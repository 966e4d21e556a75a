"""The estimator seam: measurements of the team in, the start of the horizon out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from relform_controller.ocp.problem import Prediction, TeamGeometry
from relform_controller.ocp.rotor_lag import RotorLag
from relform_core.arrays import Array
from relform_core.measurements import TeamMeasurements
from relform_core.telemetry import EstimatorReport

_NAMED_MAX = 3
"""How many things a reason names."""


@dataclass(frozen=True, eq=False)
class TeamCovariances:
    """How well a ``TeamGeometry`` is known [m, rad]."""

    pairs: Array
    """Of each pair's p_I1I2_I1 and yaw_I1I2, shape (pair, 4, 4)."""
    leader: Array
    """Of p_NI_N and yaw_NI, shape (4, 4)."""


@dataclass(frozen=True, eq=False)
class TeamEstimate:
    """The team at one instant; the pairs are those of ``layout.ordered_pairs``."""

    states: Array
    """Shape (vehicle, N_STATE), each in its own {mi}: position and yaw are zero by definition."""
    geometry: TeamGeometry
    """Where the {mi} frames lie. The leader's yaw may be off by whole turns."""
    yaw_variances: Array
    """Of ``geometry.yaw_I1I2`` [rad^2], shape (pair,); infinite: not observable."""
    yaw_held: tuple[bool, ...]
    """By pair: not measured in this step, propagated from the step before."""
    report: EstimatorReport
    unsettled: str = ""
    """At the start of a flight what is not accurate enough yet, for people: until then the team should stay
    where it is. Empty: it can fly."""
    covariances: TeamCovariances | None = None
    """None: the estimator does not know them."""
    rotor_lag: RotorLag | None = None
    """As it was found in flight; None: the estimator takes it as configured."""


@dataclass(frozen=True)
class Waiting:
    """There is no estimate yet."""

    reason: str
    """What is missing, for people."""


@dataclass(frozen=True, eq=False)
class AppliedInputs:
    """What the vehicles flew in one interval, to the best knowledge."""

    thrusts: Array
    """Commanded to the rotors [N], shape (vehicle, N_INPUT)."""
    doubt: Array
    """What would be added if the commands since a vehicle's last acknowledgement were lost [N], shape
    (vehicle, N_INPUT); zero where it has acknowledged the thrusts."""


class Estimator(Protocol):
    """Turns the measurements of each control step into an estimate of the team."""

    @property
    def estimates_disturbances(self) -> bool:
        """Whether the geometry of every estimate has disturbances, for the prediction model."""

    def update(
        self,
        measurements: TeamMeasurements,
        applied: Mapping[int, AppliedInputs],
        predicted: Prediction | None,
    ) -> TeamEstimate | Waiting:
        """The estimate at the instant of one control step; called once per step, in order.

        Args:
            measurements: what arrived in this step.
            applied: by start of the interval [ns]: of the one that ends at this instant, and of earlier ones
                about which something became known.
            predicted: what the last plan predicts for this instant; None before the first plan. An estimator
                with a model of its own does not need it.
        Returns:
            The estimate, or what it waits for. Later it waits only if it begins anew.
        """


def listed(missing: Sequence[str]) -> str:
    """The first things that are missing, and how many more; empty if nothing is."""
    named = ", ".join(missing[:_NAMED_MAX])
    more = len(missing) - _NAMED_MAX
    return f"{named} and {more} more" if more > 0 else named
