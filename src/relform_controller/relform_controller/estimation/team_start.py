"""The first belief about a team of which nothing is known but what it measures.

The leader's pose is its localization's; another vehicle's follows from mutual sightings with one that is
already placed: its position from range and bearing, its yaw from the closed form (eq. YawEst5). The first
belief lies there and knows nearly nothing: the measurements of the same instant then give it, by the filter
itself, the covariance that they have, with all cross terms.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from relform_controller.estimation import team_model, team_noise
from relform_controller.estimation.estimator import TeamCovariances, Waiting
from relform_controller.estimation.relative_yaw import (
    YawEstimate,
    relative_position_B,
    yaw_from_mutual_sight,
)
from relform_controller.estimation.team_belief import Belief, Observation
from relform_controller.estimation.team_filter import TeamFilter
from relform_controller.estimation.team_monitor import SIGHTING_GATE
from relform_controller.estimation.team_observation import ObservationBuilder
from relform_controller.ocp import layout
from relform_controller.ocp.frames import rotation_CB, rotation_z, rpy_from_quaternion, wrap_angle
from relform_core.arrays import Array
from relform_core.measurements import Odometry, TeamMeasurements
from relform_core.sensors.imu import IMU, Imu
from relform_core.sensors.localization import LOCALIZATION
from relform_core.sensors.range_bearing import RANGE_BEARING, RangeBearing, RangeBearings
from relform_core.sensors.sensor import Measurement
from relform_core.units import NANOSECONDS_PER_SECOND

SETTLING_TIME = 0.2
"""For this long the first estimates of a team that holds its place become much better [s]."""
YAW_STD_MAX = math.radians(3.0)
"""Standard deviation of a follower's yaw relative to the leader below which the team can leave its place."""


@dataclass(frozen=True, eq=False)
class FirstBelief:
    """What is known of the team at one instant, without the measurements of this instant."""

    stamp_ns: int
    belief: Belief
    measured: Mapping[tuple[str, str], object]
    """The measurements of the instant, by (vehicle, sensor)."""


class TeamStart:
    """Collects what hovering vehicles measure until all of them can be placed.

    Args:
        vehicles: names in team order, leader first.
        team_filter: the filter of the belief.
        builder: of its observations.
        hover: thrusts of all rotors in a hover [N], shape (vehicle, 4).
        yaw_std_max: beyond this a relative yaw counts as unobservable [rad].
        deviations: standard deviations of a vehicle's first belief, shape (19,).
    """

    def __init__(
        self,
        vehicles: tuple[str, ...],
        team_filter: TeamFilter,
        builder: ObservationBuilder,
        hover: Array,
        yaw_std_max: float,
        deviations: Array = team_noise.START,
    ) -> None:
        self._vehicles = vehicles
        self._deviations = deviations
        self._filter = team_filter
        self._builder = builder
        self._hover = hover
        self._yaw_std_max = yaw_std_max
        self._newest: dict[tuple[str, str], Measurement] = {}
        """By (vehicle, sensor)."""
        self._sightings: dict[tuple[int, int], tuple[int, RangeBearing]] = {}
        """The newest, with its stamp [ns], by (observer, target)."""
        self._since_ns: int | None = None
        """First call."""
        self._start_ns = 0

    def update(self, measurements: TeamMeasurements) -> FirstBelief | Waiting:
        """The first belief, or what is missing for it; called once per control step, in order."""
        if self._since_ns is None:
            self._since_ns = measurements.arrival_ns
        self._remember(measurements)
        states = first_states(
            self._vehicles,
            [self._newest_imu(name) for name in self._vehicles],
            self._localization(),
            {pair: sighting for pair, (_, sighting) in self._sightings.items()},
            self._yaw_std_max,
        )
        if isinstance(states, str):
            return Waiting(states)
        self._start_ns = max(each.stamp_ns for each in self._newest.values())
        is_at_rest = self._start_ns <= self._since_ns
        deviations = self._deviations if is_at_rest else np.hypot(self._deviations, team_noise.HOVERED)
        factor = np.diag(np.tile(deviations, len(self._vehicles)))
        everything = self._observation(None)
        fitted = self._corrected(Belief(states, factor), everything)
        if contradicting := self._contradicting(fitted, everything):
            return Waiting(contradicting)
        belief = Belief(fitted.states, factor)
        earlier = self._observation(self._start_ns)
        if earlier.own_weights.any() or earlier.sighting_weights.any():
            moved = np.diag(np.tile(team_noise.HOVERED, len(self._vehicles)))
            belief = self._corrected(belief, earlier).widened(moved)
        measured = {key: each for key, each in self._newest.items() if each.stamp_ns == self._start_ns}
        return FirstBelief(self._start_ns, belief, measured)

    def unsettled(self, now_ns: int, covariances: TeamCovariances) -> str:
        """What is not accurate enough yet for the team to leave its place; empty if it can."""
        known_for = (now_ns - self._start_ns) / NANOSECONDS_PER_SECOND
        if known_for < SETTLING_TIME:
            return f"settled estimate ({known_for:.2f} s old, {SETTLING_TIME:g} s are needed)"
        deviations = np.sqrt(covariances.pairs[: len(self._vehicles) - 1, 3, 3])  # the leader's pairs
        if deviations.max() > YAW_STD_MAX:
            return _known_too_little(self._vehicles[1 + deviations.argmax()], deviations.max(), YAW_STD_MAX)
        return ""

    def _remember(self, measurements: TeamMeasurements) -> None:
        for observer, name in enumerate(self._vehicles):
            for sensor, arrived in measurements.by_vehicle[name].by_sensor.items():
                for measurement in arrived:
                    known = self._newest.get((name, sensor))
                    if known is None or known.stamp_ns <= measurement.stamp_ns:
                        self._newest[name, sensor] = measurement
            for seen in measurements.by_vehicle[name].arrived(RANGE_BEARING):
                for target, sighting in seen.by_target.items():
                    pair = observer, self._vehicles.index(target)
                    if pair not in self._sightings or self._sightings[pair][0] <= seen.stamp_ns:
                        self._sightings[pair] = seen.stamp_ns, sighting

    def _newest_imu(self, name: str) -> Imu | None:
        measurement = self._newest.get((name, IMU.name))
        return measurement if isinstance(measurement, Imu) else None

    def _localization(self) -> Odometry | None:
        measurement = self._newest.get((self._vehicles[0], LOCALIZATION.name))
        return measurement if isinstance(measurement, Odometry) else None

    def _observation(self, before_ns: int | None) -> Observation:
        """The newest measurements, each from before an instant, without the accelerometers: the failsafe
        gives the thrusts of the hover, which the controller does not know."""
        measured: dict[tuple[str, str], object] = {
            key: each
            for key, each in self._newest.items()
            if key[1] != RANGE_BEARING.name and (before_ns is None or each.stamp_ns < before_ns)
        }
        for observer, name in enumerate(self._vehicles):
            seen = {
                self._vehicles[target]: sighting
                for (i, target), (stamp_ns, sighting) in self._sightings.items()
                if i == observer and (before_ns is None or stamp_ns < before_ns)
            }
            measured[name, RANGE_BEARING.name] = RangeBearings(0, seen)
        observation = self._builder.build(measured)
        weights = observation.own_weights.copy()
        weights[:, team_model.SPECIFIC_FORCE_ROWS] = 0.0
        return replace(observation, own_weights=weights)

    def _corrected(self, belief: Belief, observation: Observation) -> Belief:
        innovation = self._filter.innovation(belief, self._hover, observation)
        return self._filter.correct(belief, innovation)

    def _contradicting(self, fitted: Belief, observation: Observation) -> str:
        """The sighting that fits least, if it does not fit the others; empty: all do."""
        residuals = self._filter.innovation(fitted, self._hover, observation).sightings
        squared = (residuals**2).sum(axis=1)
        if squared.max() < SIGHTING_GATE:
            return ""
        i, j = layout.ordered_pairs(len(self._vehicles))[squared.argmax()]
        return f"range and bearing from {self._vehicles[i]} to {self._vehicles[j]} that fits the others"


def first_states(
    vehicles: Sequence[str],
    imus: Sequence[Imu | None],
    localization: Odometry | None,
    sightings: Mapping[tuple[int, int], RangeBearing],
    yaw_std_max: float,
) -> Array | str:
    """States of all vehicles, at rest and undisturbed, by the closed form.

    Args:
        vehicles: names in team order, leader first.
        imus: of each vehicle.
        localization: of the leader.
        sightings: by (observer, target).
        yaw_std_max: beyond this a relative yaw counts as unobservable [rad].
    Returns:
        The states, shape (vehicle, 19), or what is missing, for people.
    """
    if localization is None:
        return f"localization of {vehicles[0]}"
    tilts: list[tuple[float, float]] = []
    for index, imu in enumerate(imus):
        if imu is None:
            return f"IMU of {vehicles[index]}"
        roll, pitch, _ = rpy_from_quaternion(imu.q_NB)
        tilts.append((roll, pitch))
    R_CB = [rotation_CB(roll, pitch) for roll, pitch in tilts]
    states = np.zeros((len(imus), team_model.N_FILTER_STATE))
    states[:, [layout.ROLL, layout.PITCH]] = tilts
    states[:, team_model.THRUST_SCALE] = 1.0
    states[:, team_model.INERTIA_SCALE] = 1.0
    states[0, layout.POSITION] = localization.p_NB_N
    states[0, layout.YAW] = rpy_from_quaternion(localization.q_NB)[2]
    placed = [0]
    best_std: dict[int, float] = {}
    """Of the vehicles that are seen by placed ones, but whose yaw is known too little."""
    for i in placed:  # it grows: every vehicle is a place to start from, once it is placed
        for j in range(len(imus)):
            yaw = None if j in placed else _mutual_yaw(sightings, R_CB, i, j)
            if yaw is None:
                continue
            if (std := math.sqrt(yaw.variance)) > yaw_std_max:
                best_std[j] = min(std, best_std.get(j, math.inf))
                continue
            yaw_NC = float(states[i, layout.YAW])
            p_B1B2_C1 = R_CB[i] @ relative_position_B(sightings[i, j])
            states[j, layout.POSITION] = states[i, layout.POSITION] + rotation_z(yaw_NC) @ p_B1B2_C1
            states[j, layout.YAW] = wrap_angle(yaw_NC + yaw.yaw)
            placed.append(j)
    if not (unplaced := sorted(set(range(len(imus))) - set(placed))):
        return states
    if vertical := [j for j in unplaced if j in best_std]:
        return _known_too_little(vehicles[vertical[0]], best_std[vertical[0]], yaw_std_max)
    return f"mutual range and bearing that connects {vehicles[unplaced[0]]} with {vehicles[0]}"


def _known_too_little(vehicle: str, std: float, std_max: float) -> str:
    known = f"known to {math.degrees(std):.1f} deg" if std < math.pi else "it is right above or below another"
    return f"accurate relative yaw of {vehicle} ({known}, {math.degrees(std_max):g} deg are needed)"


def _mutual_yaw(
    sightings: Mapping[tuple[int, int], RangeBearing], R_CB: Sequence[Array], i: int, j: int
) -> YawEstimate | None:
    seen_by_i, seen_by_j = sightings.get((i, j)), sightings.get((j, i))
    if seen_by_i is None or seen_by_j is None:
        return None
    return yaw_from_mutual_sight(seen_by_i, R_CB[i], seen_by_j, R_CB[j])
