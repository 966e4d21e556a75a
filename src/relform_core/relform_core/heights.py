"""How low the vehicles of a scenario fly: the vertical part of the leader's path, and the followers below."""

from collections.abc import Mapping, Sequence

import numpy as np

from relform_core.blend import smooth_step, smooth_step_integral
from relform_core.phases_config import Hover, Motion, PhaseConfig, Spiral, Straight, Turn
from relform_core.schema import Vector3
from relform_core.start_config import StartConfig

_SAMPLES = 1001
"""Instants of a phase at which its height is computed."""


def height_problem(
    start: StartConfig, phases: Sequence[PhaseConfig], formations: Mapping[str, Mapping[str, Vector3]]
) -> str | None:
    """Why a vehicle would not stay above the ground, as one line; None if all vehicles do.

    Args:
        start: of the leader.
        phases: of the flight; their formations are known.
        formations: position of each follower relative to the leader [m], by formation and follower.
    """
    before = formations[phases[0].formation]
    height = start.position[2]
    lowest = height + min([0.0, *(place[2] - start.follower_offset_max for place in before.values())])
    if lowest <= 0.0:
        return f"start.position_m puts a vehicle at {lowest:.3f} m above ground; flights start airborne"
    climb = 0.0
    for phase in phases:
        formation = formations[phase.formation]
        down, up, climb = _vertical(phase.motion, climb, phase.duration)
        for vehicle, place in (("the leader", (0.0, 0.0, 0.0)), *before.items(), *formation.items()):
            if (lowest := height + down + place[2]) <= 0.0:
                return (
                    f"phase '{phase.name}' takes {vehicle} to {lowest:.3f} m above ground, "
                    "more than 0 m are needed: start higher, or descend less"
                )
        height, before = height + up, formation
    return None


def _vertical(motion: Motion, climb: float, duration: float) -> tuple[float, float, float]:
    """Lowest height and height at the end of a phase, both relative to its start [m], and the climb then.

    Args:
        motion: of the phase.
        climb: vertical speed at its start [m/s].
        duration: of the phase [s].
    """
    match motion:
        case Hover() | Straight():
            target, ramp = 0.0, motion.ramp
        case Spiral():
            target, ramp = motion.climb, motion.ramp
        case Turn():
            target, ramp = climb, 0.0
        case path:
            return min(0.0, *path.heights), path.heights[-1], 0.0
    time = np.linspace(0.0, duration, _SAMPLES)
    heights = climb * time + (target - climb) * smooth_step_integral(time, ramp)
    final = climb + (target - climb) * smooth_step(time[-1:], ramp)
    return float(heights.min()), float(heights[-1]), float(final[0])
