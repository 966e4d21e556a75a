"""The terms of the cost: eqs. CostFunc1 and CostFunc2, and the thrust rate."""

from collections.abc import Callable

from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.terms.acceleration import Acceleration
from relform_controller.ocp.terms.formation import Formation
from relform_controller.ocp.terms.leader_position import LeaderPosition
from relform_controller.ocp.terms.leader_yaw import LeaderYaw
from relform_controller.ocp.terms.term import Term
from relform_controller.ocp.terms.thrust_rate import ThrustRate
from relform_controller.ocp.terms.torque import Torque

TERMS: tuple[Callable[[Ocp], Term], ...] = (
    Formation,
    LeaderPosition,
    LeaderYaw,
    Acceleration,
    Torque,
    ThrustRate,
)


def make_terms(ocp: Ocp) -> tuple[Term, ...]:
    """All terms of the cost of a problem."""
    return tuple(term(ocp) for term in TERMS)
