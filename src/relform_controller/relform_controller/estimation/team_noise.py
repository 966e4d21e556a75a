"""Tuning of the team filter: what the model does not know, as standard deviations."""

from dataclasses import dataclass

import numpy as np

from relform_controller.estimation import team_model
from relform_controller.estimation.team_model import N_FILTER_STATE
from relform_controller.ocp import layout
from relform_controller.ocp.frames import rotation_CB, rotation_z
from relform_controller.ocp.model import RigidBody, torque_by_thrusts
from relform_core.arrays import Array, Mask

PERIOD = 0.05
"""Time in which the random changes of ``ProcessNoise`` happen, whatever the control period [s]."""


@dataclass(frozen=True)
class ProcessNoise:
    """Random changes within ``PERIOD``; they grow with the square root of time."""

    velocity: float = 1e-4
    """[m/s]."""
    angle: float = 5e-5
    """[rad]."""
    rate: float = 2e-4
    """[rad/s], beside what follows from the inertia."""
    inertia: float = 0.003
    """Standard deviation of the moments of inertia, relative."""
    disturbance: float = 3e-5
    """[m/s^2]."""
    thrust_scale: float = 1e-6
    inertia_scale: float = 1e-5
    drag: float = 1e-3
    """Of the acceleration by the known drag, relative: a part of it turns out to be another force."""

    def variances(
        self, thrusts: Array, duration: float, body: RigidBody, speeds: Array | float = 0.0
    ) -> Array:
        """What an interval adds to the covariance.

        Args:
            thrusts: of each rotor in the interval [N], shape (vehicle, 4).
            duration: of the interval [s].
            speeds: of each vehicle [m/s], shape (vehicle, 1); they matter for a body with drag only.
        Returns:
            Shape (vehicle, 19).
        """
        torque_B = thrusts @ torque_by_thrusts(body).T
        rate_error = self.inertia * torque_B * PERIOD / np.array(body.inertia)
        share = duration / PERIOD
        added = np.zeros((len(thrusts), N_FILTER_STATE))
        added[:, layout.POSITION] = (0.01 * self.velocity) ** 2 * share  # keeps the covariance definite
        added[:, layout.VELOCITY] = self.velocity**2 * share
        added[:, layout.RPY] = self.angle**2 * share
        added[:, layout.RATE] = (self.rate**2 + rate_error**2) * share
        disturbance = self.disturbance + self.drag * max(body.drag) / body.mass * speeds
        added[:, team_model.DISTURBANCE] = disturbance**2 * share
        added[:, team_model.THRUST_SCALE] = self.thrust_scale**2 * share
        added[:, team_model.INERTIA_SCALE] = self.inertia_scale**2 * share
        return added


def per_state(
    position: float = 0.0,
    velocity: float | tuple[float, float, float] = 0.0,
    tilt: float = 0.0,
    yaw: float = 0.0,
    rate: float = 0.0,
    disturbance: float = 0.0,
    thrust_scale: float = 0.0,
    inertia_scale: float = 0.0,
) -> Array:
    """Standard deviations of one vehicle's state, shape (19,)."""
    deviations = np.zeros(N_FILTER_STATE)
    deviations[layout.POSITION] = position
    deviations[layout.VELOCITY] = velocity
    deviations[[layout.ROLL, layout.PITCH]] = tilt
    deviations[layout.YAW] = yaw
    deviations[layout.RATE] = rate
    deviations[team_model.DISTURBANCE] = disturbance
    deviations[team_model.THRUST_SCALE] = thrust_scale
    deviations[team_model.INERTIA_SCALE] = inertia_scale
    return deviations


def first_belief(*, is_at_rest: bool, has_nominal_inertia: bool) -> Array:
    """Standard deviations of a vehicle's state before any measurement, shape (19,)."""
    deviations = (START if is_at_rest else IN_FLIGHT).copy()
    if has_nominal_inertia:
        deviations[team_model.INERTIA_SCALE] = NOMINAL_INERTIA_STD
    return deviations


def doubted(difference: Array) -> Array:
    """Deviations of one standard deviation each, as columns, for vehicles that move in one of two ways.

    Args:
        difference: between the states of the two, shape (vehicle, 19); its half is the deviation for equal
            odds.
    Returns:
        Shape (19 n, vehicle).
    """
    n, size = difference.shape
    columns = np.zeros((n, size, n))
    columns[np.arange(n), :, np.arange(n)] = 0.5 * difference
    return columns.reshape(n * size, n)


START = per_state(
    position=10.0,
    velocity=0.01,
    tilt=0.1,
    yaw=3.0,
    rate=0.02,
    disturbance=1e-3,
    thrust_scale=0.01,
    inertia_scale=0.05,
)
"""Of the first belief, before any measurement; the vehicles are level and at rest. Poses are known by
measurements alone: these are large beside their errors."""
IN_FLIGHT = per_state(
    position=10.0,
    velocity=5.0,
    tilt=0.5,
    yaw=3.0,
    rate=2.0,
    disturbance=0.5,
    thrust_scale=0.05,
    inertia_scale=0.05,
)
"""Likewise of vehicles that have flown before, in any motion."""
NOISE_OF_NOMINAL_INERTIA = ProcessNoise(rate=2e-3, inertia=0.06)
NOMINAL_INERTIA_STD = 1e-6
"""For a filter that takes the nominal moments of inertia as they are: their error is process noise."""
HOVERED = per_state(position=0.05, velocity=(0.02, 0.02, 0.08), tilt=0.05, yaw=0.05, rate=0.1)
"""Of what vehicles that hover on their own sensors do, meanwhile: the noise of the optic flow moves them up
and down at once, and sideways only slowly."""
USUAL_FORCES = np.array([0.0, 0.0, 0.0, 1.0])
"""Disturbance and thrust scale of a vehicle of which nothing else is known."""
USUAL_FORCES_STD = np.array([1.5, 1.5, 1.5, 0.15])
"""Their standard deviations. After a change they count as a measurement: a thrust scale and a vertical
disturbance that cancel each other cannot run away."""
FORCE_CHANGE = 0.5
"""Change of the forces on a vehicle, such as a gust [m/s^2]."""
THRUST_SCALE_CHANGE = 0.07
"""Change of the thrust of its rotors, relative."""
RATE_CHANGE = 0.5
"""Change of its rates by torques that the model does not explain [rad/s]."""
RESTART = per_state(position=0.2, velocity=0.3, yaw=0.2, disturbance=0.5)
"""Of a vehicle that is placed again by one sighting each way."""
UNANCHORED_POSITION = 1.0
"""Of the whole team, when its localization has jumped [m]."""
UNANCHORED_YAW = 0.3
"""Likewise [rad]."""


def changes(states: Array, forces: Mask, torques: Mask, specific_thrusts: Array, duration: float) -> Array:
    """What a change in the last interval may have done, as independent deviations.

    A force that changed has moved its vehicle before the change could be seen.

    Args:
        states: of all vehicles, shape (vehicle, 19).
        forces: the vehicles on which the forces have changed, shape (vehicle,).
        torques: likewise the torques.
        specific_thrusts: nominal thrust per mass of each vehicle [m/s^2], shape (vehicle,).
        duration: of the interval [s].
    Returns:
        Shape (19 n, m).
    """
    disturbances = range(N_FILTER_STATE)[team_model.DISTURBANCE]
    columns = []
    for vehicle in np.flatnonzero(forces):
        roll, pitch, yaw = states[vehicle, layout.RPY].tolist()
        thrust_N = specific_thrusts[vehicle] * (rotation_z(yaw) @ rotation_CB(roll, pitch))[:, 2]
        for acceleration_N, size, parameter in (
            *((axis_N, FORCE_CHANGE, state) for axis_N, state in zip(np.eye(3), disturbances, strict=True)),
            (thrust_N, THRUST_SCALE_CHANGE, team_model.THRUST_SCALE),
        ):
            column = np.zeros(states.shape)
            column[vehicle, layout.POSITION] = 0.5 * size * duration**2 * acceleration_N
            column[vehicle, layout.VELOCITY] = size * duration * acceleration_N
            column[vehicle, parameter] = size
            columns.append(column)
    for vehicle in np.flatnonzero(torques):
        for rate in range(N_FILTER_STATE)[layout.RATE]:
            column = np.zeros(states.shape)
            column[vehicle, rate] = RATE_CHANGE
            columns.append(column)
    return np.array(columns).reshape(len(columns), -1).T
