"""The check of a path of the leader against its limits."""

import math
from typing import TYPE_CHECKING

import numpy as np

from relform_core.controller_config import LeaderMotionConfig

if TYPE_CHECKING:  # it takes a tenth of a second, which only flights with such a path need
    from scipy.interpolate import CubicSpline

_SAMPLES_PER_S = 100.0
"""Number of points at which limits are checked, by time."""


def broken_limit(spline: "CubicSpline", limits: LeaderMotionConfig) -> str | None:
    """The limit that a path breaks, with value, instant and bound, as the end of a sentence; None if none.

    Args:
        spline: x, y, z [m] and yaw [rad] over time from 0 on [s].
        limits: of speed, acceleration and turn rate.
    """
    duration = float(spline.x[-1])
    times = np.linspace(0.0, duration, 1 + math.ceil(duration * _SAMPLES_PER_S))
    rates, accelerations = spline(times, 1), spline(times, 2)
    for what, unit, found, bound in (
        ("speed", "m/s", np.linalg.norm(rates[:, :3], axis=1), limits.speed_max),
        ("acceleration", "m/s^2", np.linalg.norm(accelerations[:, :3], axis=1), limits.acceleration_max),
        ("turn rate", "deg/s", np.degrees(np.abs(rates[:, 3])), math.degrees(limits.turn_rate_max)),
    ):
        worst = int(np.argmax(found))
        if found[worst] > bound * 1.001:
            return (
                f"{what} {found[worst]:.2f} {unit} after {times[worst]:.2f} s, "
                f"at most {bound:g} {unit} (controller.leader_motion)"
            )
    return None
