"""Dynamics of a quadrotor: a rigid body under rotor thrust, eqs. Dynamics1-4 and Aerodynamics.

Written in scalars for speed, in the order of the paper's equations. The prediction model of the controller is
written independently of this one, with Euler angles, so that each is an oracle for the other.
"""

import math
from dataclasses import dataclass

import numpy as np

from relform_core.schema import Vector3
from relform_core.units import GRAVITY
from relform_core.vehicle_config import VehicleConfig
from relform_sim.contact import Legs, ground_forces
from relform_sim.integrate import State

ALL_WHOLE: State = (1.0, 1.0, 1.0, 1.0)
"""Factors on the thrust of rotors none of which is weak."""
UNCERTAINTY_LIMIT = 3.0
"""Mass and inertia are drawn within this many standard deviations, so that they stay positive."""


@dataclass(frozen=True)
class Body:
    """The true parameters of one vehicle in one flight [SI]; rotors front, left, back, right."""

    mass: float
    inertia: Vector3
    """Principal moments about body x, y, z [kg m^2]."""
    arm_length: float
    thrust_coefficient: float
    torque_coefficient: float
    drag_coefficient: Vector3
    legs: Legs | None = None
    """None: there is no ground."""


@dataclass(frozen=True)
class Wrench:
    """Force of the rotors on the body, F_3 [N] along body z, and torque about body x, y, z [N m]."""

    thrust: float
    torque: Vector3


def draw_body(config: VehicleConfig, generator: np.random.Generator, *, has_ground: bool = False) -> Body:
    """The true vehicle: nominal, with a random mass and random moments of inertia; above a ground or not."""
    draws = np.clip(generator.standard_normal(4), -UNCERTAINTY_LIMIT, UNCERTAINTY_LIMIT).tolist()
    x, y, z = (
        nominal * (1.0 + config.inertia_std * draw)
        for nominal, draw in zip(config.inertia, draws[1:], strict=True)
    )
    mass = config.mass * (1.0 + config.mass_std * draws[0])
    inertia = (x, y, z)
    return Body(
        mass=mass,
        inertia=inertia,
        arm_length=config.arm_length,
        thrust_coefficient=config.thrust_coefficient,
        torque_coefficient=config.torque_coefficient,
        drag_coefficient=config.drag_coefficient,
        legs=Legs.under(mass, inertia, config.arm_length, config.leg_height) if has_ground else None,
    )


def lagged_speeds(initial: State, commanded: State, time: float, time_constant: float) -> State:
    """Rotor speeds at ``time`` after a new command: the exact solution of the first-order lag.

    Args:
        initial: rotor speeds at the command [rad/s].
        commanded: those that they approach [rad/s].
        time: since the command [s].
        time_constant: of the lag [s]; 0: none.
    """
    if time_constant == 0.0:
        return commanded
    remaining = math.exp(-time / time_constant)
    return tuple([end + (start - end) * remaining for start, end in zip(initial, commanded, strict=True)])


def rotor_wrench(
    body: Body, speeds: tuple[float, ...], scale: float, rotor_scales: State = ALL_WHOLE
) -> Wrench:
    """Eq. Aerodynamics.

    Args:
        body: of the vehicle.
        speeds: of the rotors [rad/s].
        scale: factor on thrust and torque of every rotor.
        rotor_scales: a further one for each rotor.
    """
    c_T, c_Q, d = scale * body.thrust_coefficient, scale * body.torque_coefficient, body.arm_length
    front, left, back, right = [
        rotor_scale * (speed * speed) for rotor_scale, speed in zip(rotor_scales, speeds, strict=True)
    ]
    return Wrench(
        thrust=c_T * (front + left + back + right),
        torque=(d * c_T * (left - right), d * c_T * (back - front), c_Q * (front - left + back - right)),
    )


def rotation_rows(q_NB: State) -> tuple[Vector3, Vector3, Vector3]:
    """Rows of R_NB for the unit quaternion (x, y, z, w)."""
    x, y, z, w = q_NB
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )


def rigid_body_rate(body: Body, wrench: Wrench, wind_N: Vector3, state: State) -> State:
    """Time derivative of the state (p_NB_N, v_NB_N, q_NB, w_NB_B), 13 numbers.

    Args:
        wind_N: external force in the world frame [N].
    """
    _, _, height, vx, vy, vz, qx, qy, qz, qw, wx, wy, wz = state
    R_NB = rotation_rows((qx, qy, qz, qw))
    (r11, r12, r13), (r21, r22, r23), (r31, r32, r33) = R_NB
    m = body.mass
    ix, iy, iz = body.inertia
    tau_x, tau_y, tau_z = wrench.torque
    dx, dy, dz = body.drag_coefficient
    external_x, external_y, external_z = wind_N
    if body.legs is not None and height < body.legs.reach:
        (force_x, force_y, force_z), (torque_x, torque_y, torque_z) = ground_forces(body.legs, R_NB, state)
        external_x, external_y, external_z = external_x + force_x, external_y + force_y, external_z + force_z
        tau_x, tau_y, tau_z = tau_x + torque_x, tau_y + torque_y, tau_z + torque_z

    # F_B = thrust along body z - linear drag on v_B = R_NB^T v_N
    fx = -dx * (r11 * vx + r21 * vy + r31 * vz)
    fy = -dy * (r12 * vx + r22 * vy + r32 * vz)
    fz = -dz * (r13 * vx + r23 * vy + r33 * vz) + wrench.thrust
    # angular momentum I w
    hx, hy, hz = ix * wx, iy * wy, iz * wz
    return (
        # Dynamics1: p' = v
        vx,
        vy,
        vz,
        # Dynamics2: m v' = m g + R_NB F_B + wind and ground
        (r11 * fx + r12 * fy + r13 * fz + external_x) / m,
        (r21 * fx + r22 * fy + r23 * fz + external_y) / m,
        (r31 * fx + r32 * fy + r33 * fz + external_z) / m - GRAVITY,
        # in place of Dynamics3 (Euler angles): q' = q * (w, 0) / 2
        0.5 * (qw * wx + qy * wz - qz * wy),
        0.5 * (qw * wy + qz * wx - qx * wz),
        0.5 * (qw * wz + qx * wy - qy * wx),
        -0.5 * (qx * wx + qy * wy + qz * wz),
        # Dynamics4: I w' = tau - w x I w
        (tau_x - (wy * hz - wz * hy)) / ix,
        (tau_y - (wz * hx - wx * hz)) / iy,
        (tau_z - (wx * hy - wy * hx)) / iz,
    )
