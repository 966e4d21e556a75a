"""The paper's feedback: every state of the horizon's start is taken from one sensor, without any filter.

Position and yaw of each vehicle in its own {mi} are zero by definition; the news about them lies in the
geometry. What was not measured is taken from the prediction of the last plan.
"""

from dataclasses import dataclass

import numpy as np

from relform_controller.estimation.relative_yaw import (
    YawEstimate,
    propagate,
    relative_position_B,
    yaw_from_mutual_sight,
)
from relform_controller.ocp import layout
from relform_controller.ocp.frames import rotation_CB, rpy_from_quaternion, wrap_angle
from relform_controller.ocp.layout import ordered_pairs
from relform_controller.ocp.problem import TeamGeometry
from relform_core.arrays import Array
from relform_core.errors import FlightError
from relform_core.measurements import TeamMeasurements, VehicleMeasurements
from relform_core.sensors.imu import IMU
from relform_core.sensors.localization import LOCALIZATION
from relform_core.sensors.optic_flow import OPTIC_FLOW
from relform_core.sensors.range_bearing import RANGE_BEARING, RangeBearing


@dataclass(frozen=True, eq=False)
class Prediction:
    """What the last plan says of this instant, in the {mi} frames that it predicts."""

    states: Array
    """Shape (vehicle, N_STATE); position and yaw are zero."""
    geometry: TeamGeometry


@dataclass(frozen=True, eq=False)
class Feedback:
    """Start of the horizon."""

    initial_states: Array
    """Shape (vehicle, N_STATE), each in its own {mi}."""
    geometry: TeamGeometry
    yaw_estimates: tuple[YawEstimate, ...]
    """Per ordered pair."""
    yaw_held: tuple[bool, ...]
    """Per ordered pair: not measured now, propagated with the gyros."""


class RawFeedback:
    """Turns the measurements of one step into the start of the horizon.

    Args:
        vehicles: names in team order, leader first.
        yaw_std_max: standard deviation beyond which a relative yaw counts as not observable [rad].
        period: control period [s].
    """

    def __init__(self, vehicles: tuple[str, ...], yaw_std_max: float, period: float) -> None:
        self._vehicles = vehicles
        self._pairs = ordered_pairs(len(vehicles))
        self._yaw_variance_max = yaw_std_max**2
        self._period = period
        self._yaws: dict[tuple[int, int], YawEstimate] = {}
        self._yaw_rates = np.zeros(len(vehicles))
        self._yaw_rate_variances = np.zeros(len(vehicles))

    def update(
        self, measurements: TeamMeasurements, yaw_reference: float, prediction: Prediction | None
    ) -> Feedback:
        """Start of the horizon for one step.

        Args:
            measurements: of all vehicles.
            yaw_reference: of the leader; its measured yaw is unwrapped to lie near it [rad].
            prediction: of the last plan; None in the first step.
        Raises:
            FlightError: something that cannot be predicted yet was not measured.
        """
        vehicles = [measurements.by_vehicle[name] for name in self._vehicles]
        states = np.array([self._state(index, vehicle, prediction) for index, vehicle in enumerate(vehicles)])
        R_CB = [rotation_CB(state[layout.ROLL], state[layout.PITCH]) for state in states]
        held = self._update_yaws(vehicles, R_CB)
        self._update_yaw_rates(vehicles, states)

        p_I1I2_I1 = np.zeros((len(self._pairs), 3))
        for pair, (i, j) in enumerate(self._pairs):
            if (seen := self._sight(vehicles, i, j)) is not None:
                p_I1I2_I1[pair] = R_CB[i] @ relative_position_B(seen)
            else:
                what = f"range and bearing from {self._vehicles[i]} to {self._vehicles[j]}"
                p_I1I2_I1[pair] = self._predicted(prediction, what).geometry.p_I1I2_I1[pair]
        p_NI_N, yaw_NI = self._leader_pose(vehicles[0], yaw_reference, prediction)
        yaws = tuple(self._yaws[pair] for pair in self._pairs)
        geometry = TeamGeometry(p_I1I2_I1, np.array([estimate.yaw for estimate in yaws]), p_NI_N, yaw_NI)
        return Feedback(states, geometry, yaws, held)

    def _state(self, index: int, vehicle: VehicleMeasurements, prediction: Prediction | None) -> Array:
        """State in the vehicle's own {mi}: only velocity, roll, pitch and rates can differ from zero."""
        state = np.zeros(layout.N_STATE)
        name = self._vehicles[index]
        if (imu := vehicle.newest(IMU)) is not None:
            state[layout.ROLL], state[layout.PITCH], _ = rpy_from_quaternion(imu.q_NB)
            state[layout.RATE] = imu.w_NB_B
        else:
            predicted = self._predicted(prediction, f"imu of {name}").states[index]
            state[layout.ROLL], state[layout.PITCH] = predicted[layout.ROLL], predicted[layout.PITCH]
            state[layout.RATE] = predicted[layout.RATE]
        if (flow := vehicle.newest(OPTIC_FLOW)) is not None:
            R_IB = rotation_CB(state[layout.ROLL], state[layout.PITCH])  # the yaw is zero in {mi}
            state[layout.VELOCITY] = R_IB @ flow.v_NB_B
        else:
            predicted = self._predicted(prediction, f"optic flow of {name}").states[index]
            state[layout.VELOCITY] = predicted[layout.VELOCITY]
        return state

    def _leader_pose(
        self, leader: VehicleMeasurements, yaw_reference: float, prediction: Prediction | None
    ) -> tuple[Array, float]:
        localization = leader.newest(LOCALIZATION)
        if localization is None:
            geometry = self._predicted(prediction, "localization of the leader").geometry
            return geometry.p_NI_N, geometry.yaw_NI
        _, _, yaw = rpy_from_quaternion(localization.q_NB)
        return localization.p_NB_N, yaw_reference + wrap_angle(yaw - yaw_reference)

    def _update_yaws(self, vehicles: list[VehicleMeasurements], R_CB: list[Array]) -> tuple[bool, ...]:
        held = dict.fromkeys(self._pairs, False)
        for i, j in self._pairs:
            if i > j:
                continue
            seen_by_i, seen_by_j = self._sight(vehicles, i, j), self._sight(vehicles, j, i)
            estimate = None
            if seen_by_i is not None and seen_by_j is not None:
                estimate = yaw_from_mutual_sight(seen_by_i, R_CB[i], seen_by_j, R_CB[j])
            if estimate is None or estimate.variance > self._yaw_variance_max:
                if (i, j) not in self._yaws:
                    raise FlightError(
                        f"the relative yaw of {self._names(i, j)} cannot be observed at the start: "
                        "they must see each other, and not from straight above"
                    )
                rate_variance = float(self._yaw_rate_variances[i] + self._yaw_rate_variances[j])
                rates = float(self._yaw_rates[i]), float(self._yaw_rates[j])
                estimate = propagate(self._yaws[i, j], *rates, rate_variance, self._period)
                held[i, j] = held[j, i] = True
            self._yaws[i, j] = estimate
            self._yaws[j, i] = YawEstimate(wrap_angle(-estimate.yaw), estimate.variance)
        return tuple(held.values())

    def _update_yaw_rates(self, vehicles: list[VehicleMeasurements], states: Array) -> None:
        """Yaw rates over the coming period, third row of eq. MPC_Dynamics3."""
        roll, pitch, w_IB_B = states[:, layout.ROLL], states[:, layout.PITCH], states[:, layout.RATE]
        self._yaw_rates = (np.sin(roll) * w_IB_B[:, 1] + np.cos(roll) * w_IB_B[:, 2]) / np.cos(pitch)
        for index, vehicle in enumerate(vehicles):
            if (imu := vehicle.newest(IMU)) is not None:
                self._yaw_rate_variances[index] = imu.gyro_covariance[2, 2]

    def _sight(self, vehicles: list[VehicleMeasurements], i: int, j: int) -> RangeBearing | None:
        """What vehicle i sees of vehicle j."""
        sights = vehicles[i].newest(RANGE_BEARING)
        return None if sights is None else sights.by_target.get(self._vehicles[j])

    def _names(self, i: int, j: int) -> str:
        return f"{self._vehicles[i]} and {self._vehicles[j]}"

    @staticmethod
    def _predicted(prediction: Prediction | None, what: str) -> Prediction:
        if prediction is None:
            raise FlightError(f"the flight cannot start: no {what}")
        return prediction
