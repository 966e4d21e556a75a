"""The team estimator: a Kalman filter of all vehicles; measurements may be late, lost or wrong."""

from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from relform_controller.estimation import team_geometry, team_monitor, team_noise
from relform_controller.estimation.estimator import TeamEstimate, Waiting, listed
from relform_controller.estimation.team_filter import Belief, Innovation, TeamFilter
from relform_controller.estimation.team_observation import ObservationBuilder
from relform_controller.estimation.team_start import first_belief, first_states
from relform_controller.ocp import layout
from relform_controller.ocp.model import RigidBody
from relform_controller.ocp.problem import Prediction
from relform_core.arrays import Array
from relform_core.measurements import TeamMeasurements
from relform_core.names import EstimatorMode
from relform_core.scenario_config import ScenarioConfig
from relform_core.sensors.imu import IMU
from relform_core.sensors.localization import LOCALIZATION
from relform_core.sensors.optic_flow import OPTIC_FLOW
from relform_core.sensors.range_bearing import RANGE_BEARING, RangeBearing, RangeBearings
from relform_core.sensors.sonar import SONAR
from relform_core.telemetry import EstimatorReport
from relform_core.units import NANOSECONDS_PER_SECOND

HISTORY_STEPS = 12
"""How many control periods a measurement may be late."""


@dataclass
class _Instant:
    """An instant of the recent past."""

    stamp_ns: int
    prior: tuple[Belief, Array] | None = None
    """Belief and ``team_monitor`` average before its measurements; None: to be computed again, because
    something arrived late."""
    measured: dict[tuple[str, str], object] = field(default_factory=dict)
    """By (vehicle, sensor)."""
    thrusts: Array | None = None
    """Applied from here to the next control instant [N], shape (vehicle, 4); None: as before."""


class TeamEstimator:
    """Estimates the states of all vehicles, the forces on them, and their relative poses.

    Measurements are used at the instants of their stamps: when one arrives late, the filter goes back and
    comes forward again. The estimate does not depend on the order of arrival.

    Args:
        config: the scenario; of the vehicles the nominal values only.
    """

    estimates_disturbances = True

    def __init__(self, config: ScenarioConfig) -> None:
        self._vehicles = config.team.vehicles
        self._period_ns = config.period_ns
        self._body = RigidBody.from_config(config.vehicle)
        n = len(self._vehicles)
        self._pairs = layout.ordered_pairs(n)
        index = {pair: k for k, pair in enumerate(self._pairs)}
        self._opposite = np.array([index[j, i] for i, j in self._pairs], dtype=np.intp)
        self._hover = np.full((n, layout.N_INPUT), config.vehicle.hover_thrust)
        self._filter = TeamFilter(self._body, n)
        self._noise = team_noise.ProcessNoise()
        self._builder = ObservationBuilder(self._vehicles, config.sensors.of(SONAR).range_std)
        self._yaw_variance_max = config.controller.relative_yaw_std_max**2
        used = {sensor.name for sensor in (IMU, OPTIC_FLOW, SONAR, RANGE_BEARING, LOCALIZATION)}
        self._sensors = {
            name: [sensor.name for sensor in config.sensors_of(name) if sensor.name in used]
            for name in self._vehicles
        }
        self._instants: list[_Instant] = []
        self._sightings: dict[tuple[int, int], RangeBearing] = {}

    def update(
        self, measurements: TeamMeasurements, applied: Mapping[int, Array], predicted: Prediction | None
    ) -> TeamEstimate | Waiting:
        """See ``Estimator.update``. The plan's prediction is not used: the filter has a model of its own."""
        now_ns = measurements.arrival_ns
        if not self._instants:
            waiting = self._start(measurements)
            if waiting is not None:
                return waiting
        for start_ns, thrusts in applied.items():
            if start_ns >= self._instants[0].stamp_ns:
                self._instant(start_ns).thrusts = thrusts
        self._instant(now_ns)
        for name in self._vehicles:
            for sensor, arrived in measurements.by_vehicle[name].by_sensor.items():
                for measurement in arrived:
                    if measurement.stamp_ns >= self._instants[0].stamp_ns:
                        self._instant(measurement.stamp_ns).measured[name, sensor] = measurement
        belief = self._come_forward()
        self._forget(now_ns)
        return self._estimate(belief, self._instants[-1].measured)

    def _start(self, measurements: TeamMeasurements) -> Waiting | None:
        """Place all vehicles; what is missing for it, or None."""
        vehicles = [measurements.by_vehicle[name] for name in self._vehicles]
        for i, vehicle in enumerate(vehicles):
            if (seen := vehicle.newest(RANGE_BEARING)) is not None:
                for target, sighting in seen.by_target.items():
                    self._sightings[i, self._vehicles.index(target)] = sighting
        states, missing = first_states(
            self._vehicles,
            [vehicle.newest(IMU) for vehicle in vehicles],
            vehicles[0].newest(LOCALIZATION),
            self._sightings,
            self._yaw_variance_max,
        )
        if states is None:
            return Waiting(missing)
        belief = first_belief(states, team_noise.START)
        no_drift = np.zeros((len(self._vehicles), 3))
        self._instants = [_Instant(measurements.arrival_ns, (belief, no_drift), thrusts=self._hover)]
        return None

    def _instant(self, stamp_ns: int) -> _Instant:
        """The instant with this stamp, a new one if needed; the beliefs after it become void."""
        index = bisect_left(self._instants, stamp_ns, key=lambda instant: instant.stamp_ns)
        if index == len(self._instants) or self._instants[index].stamp_ns != stamp_ns:
            self._instants.insert(index, _Instant(stamp_ns))
        for later in self._instants[index + 1 :]:
            later.prior = None
        return self._instants[index]

    def _come_forward(self) -> Belief:
        """The belief after all measurements, from the last instant at which nothing has changed."""
        known = max(i for i, instant in enumerate(self._instants) if instant.prior is not None)
        prior = self._instants[known].prior
        assert prior is not None
        thrusts = next(
            (i.thrusts for i in reversed(self._instants[: known + 1]) if i.thrusts is not None), self._hover
        )
        before = next((i.thrusts for i in reversed(self._instants[:known]) if i.thrusts is not None), thrusts)
        for instant, following in zip(
            self._instants[known:], [*self._instants[known + 1 :], None], strict=True
        ):
            instant.prior = prior
            if instant.thrusts is not None:
                thrusts = instant.thrusts
            belief, drift = self._correct(*prior, instant, before)
            if following is None:
                return belief
            duration = (following.stamp_ns - instant.stamp_ns) / NANOSECONDS_PER_SECOND
            noise = self._noise.variances(
                thrusts, duration, self._period_ns / NANOSECONDS_PER_SECOND, self._body
            )
            prior = self._filter.predict(belief, thrusts, duration, noise), drift
            before = thrusts
        raise AssertionError("unreachable")

    def _correct(
        self, belief: Belief, drift: Array, instant: _Instant, thrusts: Array
    ) -> tuple[Belief, Array]:
        """Belief and average of accelerometer innovations after the measurements of an instant."""
        observation = self._builder.build(instant.measured)
        innovation = self._filter.innovation(belief, thrusts, observation)
        changed, drift = team_monitor.force_changes(innovation, drift)
        if changed.any():
            belief = belief.inflated(np.outer(changed, team_noise.FORCE_CHANGE**2))
            innovation = self._filter.innovation(belief, thrusts, observation)
        seen = np.asarray(observation.sighting_weights.any(axis=(1, 2)))
        rejected = team_monitor.outlying_sightings(innovation, seen, self._opposite)
        return self._filter.correct(belief, _without(innovation, rejected)), drift

    def _forget(self, now_ns: int) -> None:
        horizon_ns = now_ns - HISTORY_STEPS * self._period_ns
        while len(self._instants) > 1 and self._instants[0].stamp_ns < horizon_ns:
            first, second = self._instants[:2]
            second.thrusts = first.thrusts if second.thrusts is None else second.thrusts
            del self._instants[0]

    def _estimate(self, belief: Belief, measured: Mapping[tuple[str, str], object]) -> TeamEstimate:
        """The belief in the {mi} frames of the vehicles, and what was measured at its instant."""
        states, geometry = team_geometry.states_and_geometry(belief)
        covariances = team_geometry.covariances(belief, geometry)
        lost = [
            f"{sensor} of {name}"
            for name in self._vehicles
            for sensor in self._sensors[name]
            if (name, sensor) not in measured
        ]
        mode = EstimatorMode.PREDICTED if lost else EstimatorMode.MEASURED
        return TeamEstimate(
            states,
            geometry,
            covariances.pairs[:, 3, 3],
            self._held_yaws(measured),
            EstimatorReport(mode, listed(lost)),
            covariances,
        )

    def _held_yaws(self, measured: Mapping[tuple[str, str], object]) -> tuple[bool, ...]:
        """By pair, whether the two did not see each other at this instant."""
        seen = {
            (observer, target)
            for (observer, _), bearings in measured.items()
            if isinstance(bearings, RangeBearings)
            for target in bearings.by_target
        }
        names = [(self._vehicles[i], self._vehicles[j]) for i, j in self._pairs]
        return tuple(not {(one, other), (other, one)} <= seen for one, other in names)


def _without(innovation: Innovation, rejected: team_monitor.Mask) -> Innovation:
    """The same without the sightings that are rejected."""
    keep = ~rejected
    return replace(
        innovation,
        sightings=innovation.sightings * keep[:, None],
        sighting_rows=innovation.sighting_rows * keep[:, None, None],
    )
