"""Measurements of one instant as an observation of the team filter."""

import math
from collections.abc import Mapping

import numpy as np

from relform_controller.estimation import team_model
from relform_controller.estimation.team_belief import Observation
from relform_controller.ocp.frames import rpy_from_quaternion
from relform_controller.ocp.layout import ordered_pairs
from relform_core.arrays import Array
from relform_core.measurements import UNMEASURED_VARIANCE, Odometry
from relform_core.sensors.imu import Imu
from relform_core.sensors.optic_flow import OpticFlow
from relform_core.sensors.range_bearing import RangeBearings
from relform_core.sensors.sonar import Sonar

VARIANCE_MIN = 1e-10
"""Sensors that claim to be perfect are given this variance, so that weights stay finite."""
KNOWN_WEIGHTS_MAX = 100
"""How many covariances are remembered with their weights."""


class ObservationBuilder:
    """Collects what was measured at one instant.

    Args:
        vehicles: names in team order.
        height_std: standard deviation of a sonar, whose message has none [m].
    """

    def __init__(self, vehicles: tuple[str, ...], height_std: float) -> None:
        self._vehicles = {name: index for index, name in enumerate(vehicles)}
        self._pairs = {
            (vehicles[i], vehicles[j]): pair for pair, (i, j) in enumerate(ordered_pairs(len(vehicles)))
        }
        self._height_weight = max(height_std**2, VARIANCE_MIN) ** -0.5
        self._known_weights: dict[bytes, Array] = {}

    def build(self, measured: Mapping[tuple[str, str], object]) -> Observation:
        """The observation of an instant, from its measurements by (vehicle, sensor)."""
        n_vehicles, n_pairs = len(self._vehicles), len(self._pairs)
        observation = Observation(
            own=np.zeros((n_vehicles, team_model.N_OWN_ROWS)),
            own_weights=np.zeros((n_vehicles, team_model.N_OWN_ROWS)),
            sightings=np.zeros((n_pairs, team_model.N_SIGHT_ROWS)),
            sighting_weights=np.zeros((n_pairs, team_model.N_SIGHT_ROWS, team_model.N_SIGHT_ROWS)),
        )
        seen_pairs: list[int] = []
        covariances: list[Array] = []
        for (name, _), measurement in measured.items():
            vehicle = self._vehicles[name]
            own, weights = observation.own[vehicle], observation.own_weights[vehicle]
            match measurement:
                case Imu():
                    own[team_model.TILT_ROWS] = rpy_from_quaternion(measurement.q_NB)[:2]
                    weights[team_model.TILT_ROWS] = self._weights(measurement.attitude_covariance)[:2]
                    own[team_model.RATE_ROWS] = measurement.w_NB_B
                    weights[team_model.RATE_ROWS] = self._weights(measurement.gyro_covariance)
                    own[team_model.SPECIFIC_FORCE_ROWS] = measurement.f_NB_B
                    weights[team_model.SPECIFIC_FORCE_ROWS] = self._weights(
                        measurement.accelerometer_covariance
                    )
                case OpticFlow():
                    own[team_model.FLOW_ROWS] = measurement.v_NB_B
                    weights[team_model.FLOW_ROWS] = self._weights(measurement.covariance)
                case Sonar() if math.isfinite(measurement.range):
                    own[team_model.HEIGHT_ROW] = measurement.range
                    weights[team_model.HEIGHT_ROW] = self._height_weight
                case Odometry():
                    own[team_model.POSITION_ROWS] = measurement.p_NB_N
                    weights[team_model.POSITION_ROWS] = self._weights(measurement.pose_covariance)[:3]
                    own[team_model.VELOCITY_ROWS] = measurement.v_NB_B
                    weights[team_model.VELOCITY_ROWS] = self._weights(measurement.twist_covariance)[:3]
                    own[team_model.YAW_ROW] = rpy_from_quaternion(measurement.q_NB)[2]
                    weights[team_model.YAW_ROW] = self._weights(measurement.pose_covariance)[5]
                case RangeBearings():
                    for target, seen in measurement.by_target.items():
                        pair = self._pairs[name, target]
                        observation.sightings[pair] = seen.range, seen.azimuth, seen.elevation
                        seen_pairs.append(pair)
                        covariances.append(seen.covariance)
        if seen_pairs:
            observation.sighting_weights[seen_pairs] = _roots_of_inverses(np.array(covariances))
        return observation

    def _weights(self, covariance: Array) -> Array:
        """Reciprocal standard deviations; correlations are ignored, unmeasured components get none."""
        key = covariance.tobytes()  # most sensors send the same covariance all the time
        if (weights := self._known_weights.get(key)) is None:
            variances = np.diagonal(covariance)
            weights = np.where(
                variances < UNMEASURED_VARIANCE, np.maximum(variances, VARIANCE_MIN) ** -0.5, 0.0
            )
            if len(self._known_weights) < KNOWN_WEIGHTS_MAX:
                self._known_weights[key] = weights
        return weights


def _roots_of_inverses(covariances: Array) -> Array:
    """R^(-1/2) of each, such that its transpose times itself is the inverse; shape (n, 3, 3)."""
    variances = np.diagonal(covariances, axis1=1, axis2=2)
    if np.count_nonzero(covariances) == np.count_nonzero(variances):  # as our sensors send them
        return np.eye(3) * (1.0 / np.sqrt(variances + VARIANCE_MIN))[:, None]
    return np.linalg.inv(np.linalg.cholesky(covariances + VARIANCE_MIN * np.eye(3)))
