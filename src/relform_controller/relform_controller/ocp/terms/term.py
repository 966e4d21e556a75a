"""A term of the cost: weighted squares of a residual of each vehicle, the leader or each pair, by stages.

The cost of the team is the sum of weight * residual^2 over all terms, their vehicles or pairs, stages and
rows. A term states its residual in symbols; derivatives and compiled code follow from it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import casadi as ca

from relform_controller.ocp.problem import Ocp
from relform_core.controller_config import WeightsConfig


@dataclass(frozen=True, eq=False)
class VehicleStage:
    """Symbols of one vehicle in one stage 0..N-1."""

    state: ca.SX
    """At the begin of the stage, in the vehicle's {mi}, shape (N_STATE,)."""
    commands: ca.SX
    """Thrusts [N], shape (N_INPUT,)."""
    commands_before: ca.SX
    """Of the stage before [N], shape (N_INPUT,)."""
    acceleration: ca.SX
    """g + R_IB F_B / m under the mean thrusts, and from unknown forces [m/s^2], shape (3,)."""


@dataclass(frozen=True, eq=False)
class LeaderStage:
    """Symbols of the leader in one stage 1..N."""

    state: ca.SX
    """In the leader's {mi}, shape (N_STATE,)."""
    p_NI_N: ca.SX
    """Origin of the leader's {mi} in the world [m], shape (3,)."""
    yaw_NI: ca.SX
    """Yaw of the leader's {mi} in the world [rad]."""
    p_NB_N__ref: ca.SX
    """Where the leader should be [m], shape (3,)."""
    yaw_NB__ref: ca.SX
    """Its yaw there [rad]."""


@dataclass(frozen=True, eq=False)
class PairStage:
    """Symbols of an ordered pair of vehicles in one stage 1..N."""

    observer: ca.SX
    """State of the observer in its {mi}, shape (N_STATE,)."""
    target: ca.SX
    """State of the target in its {mi}, shape (N_STATE,)."""
    p_I1I2_I1: ca.SX
    """Origin of the target's {mi} in the observer's [m], shape (3,)."""
    yaw_I1I2: ca.SX
    """Yaw of the target's {mi} relative to the observer's [rad]."""
    p_B1B2_C1__ref: ca.SX
    """Where the target should be in {mc} of the observer [m], shape (3,)."""


@dataclass(frozen=True)
class VehicleTerm:
    """A term of every vehicle in stages 0..N-1."""

    name: str
    """That of its weight in ``WeightsConfig``, if it has one there."""
    residual: Callable[[Ocp, VehicleStage], ca.SX]
    weight: Callable[[Ocp, WeightsConfig], float]


@dataclass(frozen=True)
class LeaderTerm:
    """A term of the leader in stages 1..N. At stage N its weight is scaled by ``terminal_scale``."""

    name: str
    residual: Callable[[LeaderStage], ca.SX]
    weight: Callable[[Ocp, WeightsConfig], float]


@dataclass(frozen=True)
class PairTerm:
    """A term of every ordered pair in stages 1..N. At stage N its weight is scaled by ``terminal_scale``."""

    name: str
    residual: Callable[[PairStage], ca.SX]
    weight: Callable[[Ocp, WeightsConfig, int, int], float]
    """Of one pair (observer, target)."""


@dataclass(frozen=True)
class Terms:
    """The terms of a cost."""

    vehicle: Sequence[VehicleTerm]
    leader: Sequence[LeaderTerm]
    pair: Sequence[PairTerm]

    def plus(
        self,
        *,
        vehicle: Sequence[VehicleTerm] = (),
        leader: Sequence[LeaderTerm] = (),
        pair: Sequence[PairTerm] = (),
    ) -> "Terms":
        """These terms and more, behind them."""
        return Terms((*self.vehicle, *vehicle), (*self.leader, *leader), (*self.pair, *pair))
