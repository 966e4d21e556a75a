"""Schema of the leader's paths that start and end at rest: circle, figure eight and waypoints.

On each of them the speed rises over ``ramp_s``, stays at ``speed_m_s`` and falls over ``ramp_s``.
"""

import itertools
import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from relform_core.schema import Magnitude, Schema, Vector3

ACCELERATION_MAX = 10.0
"""Bound on the acceleration of a path [m/s^2], about that of gravity."""
CORNER_MAX = math.radians(120.0)
"""Bound on the turn at a waypoint [rad]; sharper ones would turn the leader too fast."""
CLIMB_MAX = math.radians(60.0)
"""Bound on the slope between waypoints [rad]; the yaw follows the heading, which a vertical leg lacks."""
RADIUS_MIN, RADIUS_MAX = 0.1, 1000.0
"""Bounds on the magnitude of a radius, and of a coordinate of a waypoint [m]."""
EIGHT_TURN = 2.404825557695773
"""Half of the angle that the heading swings through on a figure eight [rad]: the first zero of the Bessel
function J0, for which the path closes."""
_PEAK_SLOPE = 1.5
"""Largest slope of the smooth step over a unit of time."""

_Coordinate = Annotated[float, Field(ge=-RADIUS_MAX, le=RADIUS_MAX)]


class _Path(Schema):
    """What all paths have in common."""

    speed: Annotated[float, Field(alias="speed_m_s", gt=0.0, le=20.0, examples=[1.5])]
    """Speed between the ramps."""
    ramp: Annotated[float, Field(alias="ramp_s", ge=0.1, le=60.0, examples=[1.5])]
    """Time in which the speed rises at the start, and falls at the end."""

    @property
    def heights(self) -> tuple[float, ...]:
        """Height of points between which the path neither rises nor sinks farther, the last one at its end,
        relative to its start [m]."""
        return (0.0,)

    def time_for(self, length: float) -> float:
        """Time for a length [m], both ramps included: [s]."""
        return length / self.speed + self.ramp

    def check_length(self, key: str, length: float) -> None:
        """Raise ValueError if a length [m], which ``key`` defines, leaves no room for two half ramps."""
        if length < (needed := self.speed * self.ramp):
            raise ValueError(
                f"{key} gives a length of {length:.3f} m, "
                f"at least speed_m_s * ramp_s = {needed:.3f} m is needed"
            )

    def check_acceleration(self, key: str, across: float) -> None:
        """Raise ValueError if an acceleration across the path, from ``key``, or along it is out of bounds."""
        along = _PEAK_SLOPE * self.speed / self.ramp
        for name, needed in ((key, across), ("ramp_s", along)):
            if needed > ACCELERATION_MAX:
                raise ValueError(
                    f"speed_m_s {self.speed} and {name} need {needed:.3f} m/s^2, "
                    f"at most {ACCELERATION_MAX:g} m/s^2 is possible"
                )


class _Round(_Path):
    """A closed path that is flown a number of times."""

    radius: Annotated[float, Field(alias="radius_m", examples=[2.0]), Magnitude(RADIUS_MIN, RADIUS_MAX)]
    """Smallest radius of the path; positive is first to the left."""
    turns: Annotated[int, Field(ge=1, le=100)] = 1
    """How many times the path is flown."""

    @property
    def once(self) -> float:
        """Length of the path, flown once [m]."""
        raise NotImplementedError

    @property
    def time(self) -> float:
        """Time from rest to rest [s]."""
        return self.time_for(self.turns * self.once)

    @model_validator(mode="after")
    def _possible(self) -> Self:
        self.check_length(f"radius_m {self.radius}", self.turns * self.once)
        self.check_acceleration(f"radius_m {self.radius}", self.speed**2 / abs(self.radius))
        return self


class Circle(_Round):
    """Fly a level circle that ends where it starts."""

    kind: Literal["circle"]

    @property
    def once(self) -> float:
        """See the base."""
        return math.tau * abs(self.radius)


class FigureEight(_Round):
    """Fly a level figure eight from its crossing and back; its radius is smallest in the loops."""

    kind: Literal["figure_eight"]

    @property
    def once(self) -> float:
        """See the base."""
        return math.tau * EIGHT_TURN * abs(self.radius)


class Waypoints(_Path):
    """Fly along straight legs from point to point; the velocity blends from leg to leg over ``ramp_s``.

    So corners are cut: the path leaves a leg ``speed_m_s * ramp_s / 2`` before its end.
    """

    kind: Literal["waypoints"]
    points: Annotated[
        tuple[tuple[_Coordinate, _Coordinate, _Coordinate], ...],
        Field(alias="points_m", min_length=1, max_length=1000, examples=[[[5.0, 0.0, 0.0], [7.0, 3.0, 1.0]]]),
    ]
    """Forward, to the left and up from the pose at the start of the motion; the first is straight ahead."""

    @property
    def heights(self) -> tuple[float, ...]:
        """See the base; a corner that is cut stays between its neighbours."""
        return tuple(point[2] for point in self.points)

    @property
    def legs(self) -> tuple[Vector3, ...]:
        """From each point to the next, the first one from the start [m]."""
        pairs = itertools.pairwise(((0.0, 0.0, 0.0), *self.points))
        return tuple((b[0] - a[0], b[1] - a[1], b[2] - a[2]) for a, b in pairs)

    @property
    def time(self) -> float:
        """Time from rest to rest [s]."""
        return self.time_for(sum(math.hypot(*leg) for leg in self.legs))

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if self.points[0][0] <= 0.0 or self.points[0][1] != 0.0:
            raise ValueError(
                f"points_m.0 must be straight ahead, with forward > 0 and left 0 (got {self.points[0]}): "
                "turn before, with a motion 'turn'"
            )
        for index, leg in enumerate(self.legs):
            self.check_length(f"points_m.{index}", math.hypot(*leg))
            climb = math.atan2(abs(leg[2]), math.hypot(*leg[:2]))
            _check_angle(f"points_m.{index}", "climbs or descends at", climb, CLIMB_MAX)
        for index, (before, after) in enumerate(itertools.pairwise(self.legs)):
            _check_angle(f"points_m.{index}", "turns by", _turn(before, after), CORNER_MAX)
            change = math.dist(_direction(before), _direction(after))
            self.check_acceleration(f"points_m.{index}", _PEAK_SLOPE * self.speed * change / self.ramp)
        self.check_acceleration("ramp_s", 0.0)
        return self


def _direction(leg: Vector3) -> Vector3:
    """Unit vector along a leg."""
    length = math.hypot(*leg)
    return leg[0] / length, leg[1] / length, leg[2] / length


def _turn(before: Vector3, after: Vector3) -> float:
    """Magnitude of the horizontal angle between two legs [rad]."""
    cross = before[0] * after[1] - before[1] * after[0]
    return abs(math.atan2(cross, before[0] * after[0] + before[1] * after[1]))


def _check_angle(key: str, what: str, angle: float, bound: float) -> None:
    if angle > bound + 1e-9:
        raise ValueError(
            f"{key} {what} {math.degrees(angle):.1f} deg, at most {math.degrees(bound):.0f} deg is possible"
        )
