"""Schema of ``ground``: how a team takes off and lands."""

import itertools
import math
from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field

from relform_core.schema import NonNegative, Positive, Schema, Vector3

DRIFT_MAX = 0.15
"""How far a vehicle may drift sideways while it flies on its own sensors [m]: in hovers of 20 s, 95% of the
followers stay within this, and of the leaders within half of it, whatever the size of the vehicle."""
CLIMB_MIN = 0.3
"""How far a vehicle takes off at least, above its height at rest and the least range of the sonar [m]."""


class GroundConfig(Schema):
    """Take-off and landing; each vehicle flies them on its own sensors, straight up and down."""

    climb_speed: Annotated[float, Field(alias="climb_speed_m_s", gt=0.0, le=3.0)] = 0.5
    """Vertical speed of a vehicle that takes off."""
    descent_speed: Annotated[float, Field(alias="descent_speed_m_s", gt=0.0, le=3.0)] = 0.4
    """Vertical speed of a vehicle that lands, downwards."""
    interval: Annotated[NonNegative, Field(alias="interval_s")] = 1.0
    """Time between two vehicles that take off, the highest place first, or that land one by one."""
    landing: Literal["together", "one_by_one"] = "together"
    """Whether all vehicles land at once, or one after the other, the lowest first."""
    time: Annotated[Positive, Field(alias="time_s")] = 60.0
    """Length of the flight, time on the ground included."""
    waits: bool = False
    """Whether the team waits for requests; else it takes off, flies the phases and lands."""


def take_off_problem(places_N: Mapping[str, Vector3], separation_min: float, height_min: float) -> str | None:
    """Why vehicles cannot take off straight up to their places, in one sentence; None if they can.

    Neighbours fly with nothing but their own sensors, so that both may drift towards each other.

    Args:
        places_N: by name, from the ground up [m].
        separation_min: at which two vehicles collide [m].
        height_min: of a take-off [m].
    """
    for name, place in places_N.items():
        if place[2] < height_min:
            needed_height = f"at least {height_min:.3f} m are needed"
            return f"'{name}' takes off to {place[2]:.3f} m above ground, {needed_height}"
    needed = column_spacing(separation_min)
    for (a, p_a), (b, p_b) in itertools.combinations(places_N.items(), 2):
        if (apart := math.dist(p_a[:2], p_b[:2])) < needed:
            return (
                f"'{a}' and '{b}' take off {apart:.3f} m apart, seen from above; at least {needed:.3f} m are "
                f"needed: the collision distance, and {DRIFT_MAX:g} m of drift each"
            )
    return None


def column_spacing(separation_min: float) -> float:
    """How far apart vehicles must be, seen from above, to take off and land side by side [m].

    Args:
        separation_min: at which two vehicles collide [m].
    """
    return separation_min + 2.0 * DRIFT_MAX
