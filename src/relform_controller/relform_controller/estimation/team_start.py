"""The first belief about a team of which nothing is known but what it sees of each other.

The leader's pose is its localization's; another vehicle's follows from mutual sightings with one that is
already placed: its position from range and bearing, its yaw from the closed form (eq. YawEst5).
"""

from collections.abc import Mapping, Sequence

import numpy as np

from relform_controller.estimation import team_model
from relform_controller.estimation.relative_yaw import (
    YawEstimate,
    relative_position_B,
    yaw_from_mutual_sight,
)
from relform_controller.estimation.team_filter import Belief
from relform_controller.ocp import layout
from relform_controller.ocp.frames import rotation_CB, rotation_z, rpy_from_quaternion, wrap_angle
from relform_core.arrays import Array
from relform_core.measurements import Odometry
from relform_core.sensors.imu import Imu
from relform_core.sensors.range_bearing import RangeBearing


def first_states(
    vehicles: Sequence[str],
    imus: Sequence[Imu | None],
    localization: Odometry | None,
    sightings: Mapping[tuple[int, int], RangeBearing],
    yaw_variance_max: float,
) -> tuple[Array | None, str]:
    """States of all vehicles, at rest and undisturbed, and what is missing if they cannot be known yet.

    Args:
        vehicles: names in team order, leader first.
        imus: of each vehicle.
        localization: of the leader.
        sightings: by (observer, target).
        yaw_variance_max: beyond this a relative yaw counts as unobservable [rad^2].
    Returns:
        The states, shape (vehicle, 16), or None; what is missing, for people.
    """
    if localization is None:
        return None, f"localization of {vehicles[0]}"
    tilts: list[tuple[float, float]] = []
    for index, imu in enumerate(imus):
        if imu is None:
            return None, f"IMU of {vehicles[index]}"
        roll, pitch, _ = rpy_from_quaternion(imu.q_NB)
        tilts.append((roll, pitch))
    R_CB = [rotation_CB(roll, pitch) for roll, pitch in tilts]
    states = np.zeros((len(imus), team_model.N_FILTER_STATE))
    states[:, [layout.ROLL, layout.PITCH]] = tilts
    states[:, team_model.THRUST_SCALE] = 1.0
    states[0, layout.POSITION] = localization.p_NB_N
    states[0, layout.YAW] = rpy_from_quaternion(localization.q_NB)[2]
    placed = [0]
    for i in placed:  # it grows: every vehicle is a place to start from, once it is placed
        for j in range(len(imus)):
            yaw = None if j in placed else _mutual_yaw(sightings, R_CB, i, j)
            if yaw is None or yaw.variance > yaw_variance_max:
                continue
            yaw_NC = float(states[i, layout.YAW])
            p_B1B2_C1 = R_CB[i] @ relative_position_B(sightings[i, j])
            states[j, layout.POSITION] = states[i, layout.POSITION] + rotation_z(yaw_NC) @ p_B1B2_C1
            states[j, layout.YAW] = wrap_angle(yaw_NC + yaw.yaw)
            placed.append(j)
    if missing := sorted(set(range(len(imus))) - set(placed)):
        unplaced = vehicles[missing[0]]
        return None, f"mutual range and bearing that connects {unplaced} with {vehicles[0]}"
    return states, ""


def first_belief(states: Array, deviations: Array) -> Belief:
    """A belief with independent errors.

    Args:
        states: shape (vehicle, 16).
        deviations: standard deviations of one vehicle's state, shape (16,).
    """
    return Belief(states, np.diag(np.tile(deviations, len(states))))


def _mutual_yaw(
    sightings: Mapping[tuple[int, int], RangeBearing], R_CB: Sequence[Array], i: int, j: int
) -> YawEstimate | None:
    seen_by_i, seen_by_j = sightings.get((i, j)), sightings.get((j, i))
    if seen_by_i is None or seen_by_j is None:
        return None
    return yaw_from_mutual_sight(seen_by_i, R_CB[i], seen_by_j, R_CB[j])
