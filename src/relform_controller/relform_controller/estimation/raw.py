"""The paper's feedback: every state of the horizon's start is taken from one sensor, without any filter.

Position and yaw of each vehicle in its own {mi} are zero by definition; their measurements enter through the
geometry. What was not measured is taken from the prediction of the last plan.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from relform_controller.estimation.estimator import AppliedInputs, TeamEstimate, Waiting, listed
from relform_controller.estimation.relative_yaw import (
    YawEstimate,
    propagate,
    relative_position_B,
    yaw_from_mutual_sight,
)
from relform_controller.ocp import layout
from relform_controller.ocp.frames import rotation_CB, rpy_from_quaternion, wrap_angle
from relform_controller.ocp.layout import ordered_pairs
from relform_controller.ocp.problem import Prediction, TeamGeometry
from relform_core.arrays import Array
from relform_core.measurements import TeamMeasurements, VehicleMeasurements
from relform_core.names import EstimatorMode
from relform_core.sensors.imu import IMU
from relform_core.sensors.localization import LOCALIZATION
from relform_core.sensors.optic_flow import OPTIC_FLOW
from relform_core.sensors.range_bearing import RANGE_BEARING, RangeBearing
from relform_core.telemetry import EstimatorReport


@dataclass
class _Gaps:
    """What was not measured in one step, and whether something stands in for it."""

    predicted: list[str] = field(default_factory=list)
    unknown: list[str] = field(default_factory=list)

    def fill(self, what: str, stand_in: Array) -> Array:
        """Use a value in place of a measurement; NaN: there is none."""
        (self.unknown if np.isnan(stand_in).any() else self.predicted).append(what)
        return stand_in


class RawEstimator:
    """Turns the measurements of one step into the start of the horizon.

    Before the first plan there is no prediction. The vehicles hover then, so what was measured in an earlier
    step stands in for what was lost; the estimator waits until everything was measured once.

    Args:
        vehicles: names in team order, leader first.
        yaw_std_max: standard deviation beyond which a relative yaw counts as not observable [rad].
        period: control period [s].
    """

    estimates_disturbances = False

    def __init__(self, vehicles: tuple[str, ...], yaw_std_max: float, period: float) -> None:
        n = len(vehicles)
        self._vehicles = vehicles
        self._pairs = ordered_pairs(n)
        self._yaw_variance_max = yaw_std_max**2
        self._period = period
        self._yaws: dict[tuple[int, int], YawEstimate] = {}
        self._yaw_rates = np.zeros(n)
        self._yaw_rate_variances = np.zeros(n)
        n_pairs = len(self._pairs)
        unknown = TeamGeometry(
            np.full((n_pairs, 3), np.nan), np.full(n_pairs, np.nan), np.full(3, np.nan), np.nan
        )
        self._before_start = Prediction(np.full((n, layout.N_STATE), np.nan), unknown)
        """The newest measurements, as long as there is no plan; NaN where there was none yet."""

    def update(
        self,
        measurements: TeamMeasurements,
        applied: Mapping[int, AppliedInputs],
        predicted: Prediction | None,
    ) -> TeamEstimate | Waiting:
        """See ``Estimator.update``. The applied inputs are not used: raw feedback has no model."""
        source = self._before_start if predicted is None else predicted
        vehicles = [measurements.by_vehicle[name] for name in self._vehicles]
        gaps = _Gaps()
        states = np.array([self._state(i, vehicle, source, gaps) for i, vehicle in enumerate(vehicles)])
        R_CB = [rotation_CB(state[layout.ROLL], state[layout.PITCH]) for state in states]
        held = self._update_yaws(vehicles, R_CB)
        self._update_yaw_rates(vehicles, states)

        p_I1I2_I1 = np.zeros((len(self._pairs), 3))
        for pair, (i, j) in enumerate(self._pairs):
            if (seen := self._sight(vehicles, i, j)) is not None:
                p_I1I2_I1[pair] = R_CB[i] @ relative_position_B(seen)
            else:
                what = f"range and bearing from {self._vehicles[i]} to {self._vehicles[j]}"
                p_I1I2_I1[pair] = gaps.fill(what, source.geometry.p_I1I2_I1[pair])
        p_NI_N, yaw_NI = self._leader_pose(vehicles[0], source, gaps)
        yaws = [self._yaws.get(pair, YawEstimate(np.nan, np.inf)) for pair in self._pairs]
        geometry = TeamGeometry(p_I1I2_I1, np.array([estimate.yaw for estimate in yaws]), p_NI_N, yaw_NI)
        if predicted is None:
            self._before_start = Prediction(states, geometry)
            if missing := [*gaps.unknown, *self._unknown_yaws(p_I1I2_I1)]:
                return Waiting(listed(missing))
        lost = [*gaps.predicted, *gaps.unknown]
        mode = EstimatorMode.PREDICTED if lost else EstimatorMode.MEASURED
        return TeamEstimate(
            states,
            geometry,
            np.array([estimate.variance for estimate in yaws]),
            held,
            EstimatorReport(mode, listed(lost)),
        )

    def _state(self, index: int, vehicle: VehicleMeasurements, source: Prediction, gaps: _Gaps) -> Array:
        """State in the vehicle's own {mi}: only velocity, roll, pitch and rates can differ from zero."""
        state = np.zeros(layout.N_STATE)
        name, predicted = self._vehicles[index], source.states[index]
        if (imu := vehicle.newest(IMU)) is not None:
            state[layout.ROLL], state[layout.PITCH], _ = rpy_from_quaternion(imu.q_NB)
            state[layout.RATE] = imu.w_NB_B
        else:
            attitude = [layout.ROLL, layout.PITCH, *range(layout.N_STATE)[layout.RATE]]
            state[attitude] = gaps.fill(f"imu of {name}", predicted[attitude])
        if (flow := vehicle.newest(OPTIC_FLOW)) is not None:
            R_IB = rotation_CB(state[layout.ROLL], state[layout.PITCH])  # the yaw is zero in {mi}
            state[layout.VELOCITY] = R_IB @ flow.v_NB_B
        else:
            state[layout.VELOCITY] = gaps.fill(f"optic flow of {name}", predicted[layout.VELOCITY])
        return state

    def _leader_pose(
        self, leader: VehicleMeasurements, source: Prediction, gaps: _Gaps
    ) -> tuple[Array, float]:
        if (localization := leader.newest(LOCALIZATION)) is None:
            p_NI_N = gaps.fill("localization of the leader", source.geometry.p_NI_N)
            return p_NI_N, source.geometry.yaw_NI
        _, _, yaw = rpy_from_quaternion(localization.q_NB)
        return localization.p_NB_N, yaw

    def _update_yaws(self, vehicles: list[VehicleMeasurements], R_CB: list[Array]) -> tuple[bool, ...]:
        """Measure the relative yaws, and propagate those that cannot be measured; whether so, by pair."""
        held = dict.fromkeys(self._pairs, False)
        for i, j in self._pairs:
            if i > j:
                continue
            seen_by_i, seen_by_j = self._sight(vehicles, i, j), self._sight(vehicles, j, i)
            estimate = None
            if seen_by_i is not None and seen_by_j is not None:
                estimate = yaw_from_mutual_sight(seen_by_i, R_CB[i], seen_by_j, R_CB[j])
            if estimate is None or not estimate.variance <= self._yaw_variance_max:
                if (i, j) not in self._yaws:
                    continue
                rate_variance = float(self._yaw_rate_variances[i] + self._yaw_rate_variances[j])
                rates = float(self._yaw_rates[i]), float(self._yaw_rates[j])
                estimate = propagate(self._yaws[i, j], *rates, rate_variance, self._period)
                held[i, j] = held[j, i] = True
            self._yaws[i, j] = estimate
            self._yaws[j, i] = YawEstimate(wrap_angle(-estimate.yaw), estimate.variance)
        return tuple(held.values())

    def _unknown_yaws(self, p_I1I2_I1: Array) -> list[str]:
        """The relative yaws that were never observed, though the positions of both vehicles were."""
        seen = {pair: not np.isnan(p).any() for pair, p in zip(self._pairs, p_I1I2_I1, strict=True)}
        return [
            f"relative yaw of {self._vehicles[i]} and {self._vehicles[j]} "
            "(both must see each other in one step, and not from straight above)"
            for i, j in self._pairs
            if i < j and (i, j) not in self._yaws and seen[i, j] and seen[j, i]
        ]

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
