"""Soft constraints h <= 0 at stages 1..N, in symbols: of each vehicle, and of pairs.

Each h is to first order the distance from the bound, in metres, radians or metres per second. What a
violation costs is in its `Prices`.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import casadi as ca

from relform_controller.ocp import layout
from relform_controller.ocp.model import rotation_IB, rotation_z
from relform_core.arrays import Mask
from relform_core.constraints_config import (
    BoxObstacle,
    ConstraintsConfig,
    FieldOfViewConstraint,
    Obstacle,
    Prices,
    SphereObstacle,
)


@dataclass(frozen=True)
class VehicleConstraint:
    """A constraint of every vehicle."""

    name: str
    subject: str
    """What it is about beside the vehicle; empty: nothing."""
    prices: Prices
    excess: Callable[[ca.SX, ca.SX], ca.SX]
    """h, from the state in {mi} and the position p_NB_N of the vehicle."""


@dataclass(frozen=True)
class PairConstraint:
    """A constraint of some ordered pairs."""

    name: str
    prices: Prices
    pairs: frozenset[tuple[int, int]]
    """(observer, target)."""
    excess: Callable[[ca.SX, ca.SX], ca.SX]
    """h, from the state of the observer in its {mi}, and the target relative to it, p_B1B2_I1."""


@dataclass(frozen=True)
class Constraints:
    """The soft constraints of a problem."""

    vehicle: Sequence[VehicleConstraint]
    pair: Sequence[PairConstraint]
    names: Sequence[str]
    """Of every row of a stage: those of each vehicle in team order, then those of each pair."""

    @property
    def exist(self) -> bool:
        """Whether there are any."""
        return bool(self.vehicle or self.pair)

    def active(self, rows: Mask) -> tuple[str, ...]:
        """Names of those that are active at some stage; ``rows`` has the shape (stage, row)."""
        return tuple(name for name, at_stages in zip(self.names, rows.T, strict=True) if at_stages.any())


NO_CONSTRAINTS = Constraints((), (), ())


def make_constraints(
    config: ConstraintsConfig, obstacles: Sequence[Obstacle], vehicles: Sequence[str]
) -> Constraints:
    """The constraints that a configuration asks for.

    Args:
        config: bounds and prices.
        obstacles: of the world.
        vehicles: names in team order.
    """
    vehicle: list[VehicleConstraint] = []
    pair: list[PairConstraint] = []
    if (tilt := config.tilt) is not None:
        vehicle.append(VehicleConstraint("tilt", "", tilt, lambda state, _: _tilt_excess(state, tilt.max)))
    if (speed := config.speed) is not None:
        vehicle.append(
            VehicleConstraint("speed", "", speed, lambda state, _: _speed_excess(state, speed.max))
        )
    if (keep_out := config.keep_out) is not None:
        for number, obstacle in enumerate(obstacles):
            excess = _clearance_excess(obstacle, keep_out.margin)
            vehicle.append(VehicleConstraint("keep_out", f"obstacles.{number}", keep_out, excess))
    if (separation := config.separation) is not None:
        once = frozenset((i, j) for i, j in layout.ordered_pairs(len(vehicles)) if i < j)
        pair.append(
            PairConstraint("separation", separation, once, lambda _, p: separation.min - ca.norm_2(p))
        )
    if (view := config.field_of_view) is not None:
        seen = frozenset(
            (vehicles.index(observer), vehicles.index(target)) for observer, target in view.pairs
        )
        pair.append(
            PairConstraint("field_of_view", view, seen, lambda state, p: _view_excess(state, p, view))
        )
        pair.append(PairConstraint("view_range", view, seen, lambda _, p: ca.norm_2(p) - view.range_max))
    names = [f"{each.name} {name} {each.subject}".rstrip() for name in vehicles for each in vehicle]
    names += [
        f"{each.name} {vehicles[i]} {vehicles[j]}"
        for i, j in layout.ordered_pairs(len(vehicles))
        for each in pair
        if (i, j) in each.pairs
    ]
    return Constraints(vehicle, pair, names)


def distance(obstacle: Obstacle, p_NB_N: ca.SX) -> ca.SX:
    """From the surface of an obstacle, negative inside [m]."""
    from_center = p_NB_N - ca.DM(obstacle.center)
    match obstacle:
        case SphereObstacle():
            return ca.norm_2(from_center) - obstacle.radius
        case BoxObstacle():
            beyond = ca.fabs(rotation_z(ca.SX(-obstacle.yaw)) @ from_center) - 0.5 * ca.DM(obstacle.size)
            # The square root has no slope at 0, which is inside.
            outside = ca.sqrt(ca.sumsqr(ca.fmax(beyond, 0.0)) + 1e-12)
            return outside + ca.fmin(ca.mmax(beyond), 0.0)


def _clearance_excess(obstacle: Obstacle, margin: float) -> Callable[[ca.SX, ca.SX], ca.SX]:
    """How much closer than the margin a vehicle is [m]."""
    return lambda _, p_NB_N: margin - distance(obstacle, p_NB_N)


def _tilt_excess(state: ca.SX, tilt_max: float) -> ca.SX:
    """The tilt minus its bound to first order, smooth at zero tilt [rad]."""
    cosine = ca.cos(state[layout.ROLL]) * ca.cos(state[layout.PITCH])
    return (math.cos(tilt_max) - cosine) / math.sin(tilt_max)


def _speed_excess(state: ca.SX, speed_max: float) -> ca.SX:
    """The speed minus its bound to first order, smooth at rest [m/s]."""
    return (ca.sumsqr(state[layout.VELOCITY]) - speed_max**2) / (2.0 * speed_max)


def _view_excess(state: ca.SX, p_B1B2_I1: ca.SX, view: FieldOfViewConstraint) -> ca.SX:
    """The angle between axis and target minus its bound to first order [rad]."""
    axis_B = ca.vertcat(
        math.cos(view.axis_elevation) * math.cos(view.axis_azimuth),
        math.cos(view.axis_elevation) * math.sin(view.axis_azimuth),
        math.sin(view.axis_elevation),
    )
    axis_I = rotation_IB(state[layout.RPY]) @ axis_B
    cosine = ca.dot(axis_I, p_B1B2_I1) / ca.norm_2(p_B1B2_I1)
    return (math.cos(view.half_angle) - cosine) / math.sin(view.half_angle)
