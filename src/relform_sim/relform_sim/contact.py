"""The ground under a vehicle: four legs with friction on the plane z = 0.

Each leg is a spring whose damping grows with its deflection (Hunt and Crossley), so that the force is
continuous when a foot touches. Friction is Coulomb's, regularised: a foot at rest creeps instead of sticking.
"""

import math
from dataclasses import dataclass
from typing import Self

from relform_core.schema import Vector3
from relform_core.units import GRAVITY
from relform_sim.integrate import State

STIFFNESS_RATE = 80.0
"""Natural frequency of the stiffest mode of a vehicle on its legs [rad/s]: well resolved by steps of 5 ms."""
DAMPING_RATIO = 0.5
"""Of the vertical mode, at rest."""
GRIP_RATE = 300.0
"""Decay rate of the fastest mode of a sliding vehicle [1/s]; RK4 at 5 ms is stable up to 557."""
FRICTION = 0.6
"""Coulomb's coefficient."""


@dataclass(frozen=True)
class Legs:
    """Four legs below the rotors, along body x and y; the feet are ``length`` below the body origin."""

    spread: float
    """Distance of each foot from body z [m]."""
    length: float
    """Without load [m]."""
    stiffness: float
    """Of each leg [N/m]."""
    damping: float
    """Relative change of the force of a leg per speed of its deflection [s/m]."""
    grip: float
    """Friction of each foot per speed, while it is far below Coulomb's limit [N s/m]."""

    @classmethod
    def under(cls, mass: float, inertia: Vector3, arm_length: float, height: float) -> Self:
        """The legs on which a vehicle rests at a height of its body origin.

        Stiffness and grip are as high as the rates of this module allow: of heaving, rolling and pitching
        on the springs; of turning, and of sliding, which also rolls and pitches, in friction.

        Args:
            mass: [kg].
            inertia: principal moments about body x, y, z [kg m^2].
            arm_length: of the rotors [m].
            height: [m].
        """
        ix, iy, iz = inertia
        softest = max(4.0 / mass, 2.0 * arm_length**2 / ix, 2.0 * arm_length**2 / iy)
        stiffness = STIFFNESS_RATE**2 / softest
        length = height + mass * GRAVITY / (4.0 * stiffness)
        lightest = max(1.0 / mass + length**2 / min(ix, iy), arm_length**2 / iz)
        heaving = math.sqrt(4.0 * stiffness / mass)
        return cls(
            spread=arm_length,
            length=length,
            stiffness=stiffness,
            damping=2.0 * DAMPING_RATIO * heaving / GRAVITY,
            grip=GRIP_RATE / (4.0 * lightest),
        )

    @property
    def reach(self) -> float:
        """At this height of the body origin and above, no foot touches, whatever the attitude [m]."""
        return math.hypot(self.spread, self.length)

    @property
    def feet(self) -> tuple[tuple[float, float], ...]:
        """Body x and y of the feet [m]."""
        a = self.spread
        return ((a, 0.0), (0.0, a), (-a, 0.0), (0.0, -a))


Rows = tuple[Vector3, Vector3, Vector3]


def touches(legs: Legs, height: float, R_NB: Rows) -> bool:
    """Whether a foot is in the ground.

    Args:
        legs: of the vehicle.
        height: of the body origin [m].
        R_NB: rows of the attitude.
    """
    r31, r32, r33 = R_NB[2]
    return any(height + (r31 * x + r32 * y - r33 * legs.length) < 0.0 for x, y in legs.feet)


def ground_forces(legs: Legs, R_NB: Rows, state: State) -> tuple[Vector3, Vector3]:
    """What the ground does to a vehicle.

    Args:
        legs: of the vehicle.
        R_NB: rows of its attitude.
        state: p_NB_N, v_NB_N, q_NB, w_NB_B, 13 numbers.
    Returns:
        Force in the world frame [N], and torque about body x, y, z [N m].
    """
    (r11, r12, r13), (r21, r22, r23), (r31, r32, r33) = R_NB
    _, _, height, vx, vy, vz, _, _, _, _, wx, wy, wz = state
    force_x = force_y = force_z = torque_x = torque_y = torque_z = 0.0
    z = -legs.length
    for x, y in legs.feet:
        depth = -(height + (r31 * x + r32 * y + r33 * z))
        if depth <= 0.0:
            continue
        # velocity of the foot: v + R_NB (w x foot)
        ux, uy, uz = wy * z - wz * y, wz * x - wx * z, wx * y - wy * x
        sx = vx + (r11 * ux + r12 * uy + r13 * uz)
        sy = vy + (r21 * ux + r22 * uy + r23 * uz)
        sz = vz + (r31 * ux + r32 * uy + r33 * uz)
        fz = legs.stiffness * depth * (1.0 - legs.damping * sz)
        if fz <= 0.0:
            continue
        # Coulomb's limit is approached by a slip that is fast compared with limit / grip.
        limit = FRICTION * fz
        viscous = legs.grip * limit / math.sqrt(limit * limit + legs.grip * legs.grip * (sx * sx + sy * sy))
        fx, fy = -viscous * sx, -viscous * sy
        bx, by, bz = (
            r11 * fx + r21 * fy + r31 * fz,
            r12 * fx + r22 * fy + r32 * fz,
            r13 * fx + r23 * fy + r33 * fz,
        )
        force_x += fx
        force_y += fy
        force_z += fz
        torque_x += y * bz - z * by
        torque_y += z * bx - x * bz
        torque_z += x * by - y * bx
    return (force_x, force_y, force_z), (torque_x, torque_y, torque_z)
