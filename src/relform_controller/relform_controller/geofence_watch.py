"""Watches on the estimates whether a vehicle has left the geofence, or may have."""

from collections.abc import Mapping, Sequence

import numpy as np

from relform_controller.estimation.estimator import TeamEstimate
from relform_controller.ocp.frames import rotation_z
from relform_core.arrays import Array
from relform_core.geofence_config import GeofenceConfig

STDS = 2.0
"""How many standard deviations of the estimate a vehicle must be inside."""


class GeofenceWatch:
    """The geofence of a team, leader first.

    Args:
        vehicles: names in team order.
        fence: where they may fly.
    """

    def __init__(self, vehicles: Sequence[str], fence: GeofenceConfig) -> None:
        self._vehicles = vehicles
        self._fence = fence

    def outside(self, estimate: TeamEstimate) -> Mapping[str, str]:
        """Which vehicles are outside, or may be, and where, in words."""
        places, stds = world_places(estimate, len(self._vehicles))
        found = {}
        for name, p_NB_N, std in zip(self._vehicles, places, stds, strict=True):
            if breach := self._fence.breach(p_NB_N, STDS * std):
                found[name] = f"may be outside the geofence: {breach}"
            if breach := self._fence.breach(p_NB_N):
                found[name] = f"is outside the geofence: {breach}"
        return found


def world_places(estimate: TeamEstimate, n_vehicles: int) -> tuple[Array, Array]:
    """Estimated positions p_NB_N [m], leader first, and their standard deviations, shape (vehicle, 3) each.

    The deviations are zero if the estimator does not know them. Those of a follower add up what is uncertain
    about the leader, about its yaw, and about the follower relative to it.
    """
    geometry, covariances = estimate.geometry, estimate.covariances
    R_NI = rotation_z(geometry.yaw_NI)
    # The first pairs are those that the leader observes.
    from_leader_N = np.vstack([np.zeros(3), geometry.p_I1I2_I1[: n_vehicles - 1] @ R_NI.T])
    places = geometry.p_NI_N + from_leader_N
    if covariances is None:
        return places, np.zeros_like(places)
    variances = np.tile(covariances.leader.diagonal()[:3], (n_vehicles, 1))
    variances[:, :2] += covariances.leader[3, 3] * from_leader_N[:, 1::-1] ** 2
    for vehicle in range(1, n_vehicles):
        variances[vehicle] += (R_NI @ covariances.pairs[vehicle - 1, :3, :3] @ R_NI.T).diagonal()
    return places, np.sqrt(variances)
