"""The team estimator: a Kalman filter of all vehicles; measurements may be late, lost or wrong."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from relform_controller.estimation import (
    team_model,
    team_monitor,
    team_noise,
    team_restart,
)
from relform_controller.estimation.estimator import AppliedInputs, TeamEstimate, Waiting
from relform_controller.estimation.lag_finder import CANDIDATES, LagEvidence, LagFinder
from relform_controller.estimation.team_belief import Belief, Innovation, Observation
from relform_controller.estimation.team_filter import TeamFilter
from relform_controller.estimation.team_health import TeamHealth
from relform_controller.estimation.team_kernel import make_team_filter
from relform_controller.estimation.team_monitor import Memory
from relform_controller.estimation.team_observation import ObservationBuilder
from relform_controller.estimation.team_start import FirstBelief, TeamStart
from relform_controller.estimation.timeline import Measured, Timeline
from relform_controller.ocp import layout
from relform_controller.ocp.model import RigidBody
from relform_controller.ocp.problem import Prediction
from relform_controller.ocp.rotor_lag import RotorLag
from relform_core.arrays import Array, Mask
from relform_core.controller_config import TeamEstimatorConfig
from relform_core.measurements import TeamMeasurements
from relform_core.scenario_config import ScenarioConfig
from relform_core.sensors.imu import IMU, Imu
from relform_core.sensors.localization import LOCALIZATION
from relform_core.sensors.optic_flow import OPTIC_FLOW
from relform_core.sensors.range_bearing import RANGE_BEARING, RangeBearings
from relform_core.sensors.sonar import SONAR
from relform_core.telemetry import EstimatorReport
from relform_core.units import NANOSECONDS_PER_SECOND

HISTORY_STEPS = 12
"""How many control periods a measurement may be late."""


@dataclass(frozen=True, eq=False)
class _Known:
    """What is known at one instant."""

    belief: Belief
    memory: Memory
    inputs: AppliedInputs
    """Of the interval that ends here."""
    rotors: LagEvidence

    @property
    def thrusts(self) -> Array:
        """Thrusts of the rotors at this instant [N], shape (vehicle, 4)."""
        thrusts: Array = self.rotors.thrusts[self.rotors.best]
        return thrusts


@dataclass
class _Findings:
    """What one update found in the measurements that arrived."""

    fresh: set[tuple[int, str]]
    """Stamp and observer of the sightings that arrived."""
    nis: float = 0.0
    n_sightings: int = 0
    rejected: list[str] = field(default_factory=list)
    contradictions: list[str] = field(default_factory=list)


class TeamEstimator:
    """Estimates the states of all vehicles, the forces on them, and their relative poses.

    Measurements are used at the instants of their stamps: when one arrives late, the filter goes back and
    comes forward again. The estimate does not depend on the order of arrival.

    Args:
        config: the scenario; of the vehicles the nominal values only.
        team_filter: None: the compiled one, if there is a compiler.
        is_at_rest: whether the vehicles hover at the first update; else they may move in any way.
    """

    estimates_disturbances = True

    def __init__(
        self, config: ScenarioConfig, team_filter: TeamFilter | None = None, *, is_at_rest: bool = True
    ) -> None:
        self._vehicles = config.team.vehicles
        self._period_ns = config.period_ns
        self._body = RigidBody.from_config(config.vehicle)
        n = len(self._vehicles)
        self._pairs = layout.ordered_pairs(n)
        index = {pair: k for k, pair in enumerate(self._pairs)}
        self._opposite = np.array([index[j, i] for i, j in self._pairs], dtype=np.intp)
        self._hover = np.full((n, layout.N_INPUT), config.vehicle.hover_thrust)
        self._filter = make_team_filter(self._body, n) if team_filter is None else team_filter
        chosen = config.controller.estimator
        self._options = (
            chosen if isinstance(chosen, TeamEstimatorConfig) else TeamEstimatorConfig(kind="team")
        )
        self._rotor_lag = RotorLag(config.vehicle.rotor_time_constant)
        """As it was at the last update."""
        candidates = CANDIDATES if self._options.finds_rotor_lag else ()
        self._lag_finder = LagFinder(self._body, config.vehicle.rotor_time_constant, candidates)
        has_nominal_inertia = not self._options.estimates_inertia
        self._noise = (
            team_noise.NOISE_OF_NOMINAL_INERTIA if has_nominal_inertia else team_noise.ProcessNoise()
        )
        self._has_nominal_inertia = has_nominal_inertia
        self._builder = ObservationBuilder(self._vehicles, config.sensors.of(SONAR).range_std)
        self._yaw_std_max = config.controller.relative_yaw_std_max
        self._start = self._new_start(is_at_rest=is_at_rest)
        self._restarts = 0
        """How often the estimator has begun anew."""
        used = {sensor.name for sensor in (IMU, OPTIC_FLOW, SONAR, RANGE_BEARING, LOCALIZATION)}
        sensors = {
            name: [sensor.name for sensor in config.sensors_of(name) if sensor.name in used]
            for name in self._vehicles
        }
        self._health = TeamHealth(sensors, config.targets_of, start_ns=0)
        self._timeline: Timeline[_Known, AppliedInputs] | None = None
        self._findings = _Findings(set())
        self.belief: Belief | None = None
        """After the measurements of the last update; None: there is none yet."""

    def update(
        self,
        measurements: TeamMeasurements,
        applied: Mapping[int, AppliedInputs],
        predicted: Prediction | None,
    ) -> TeamEstimate | Waiting:
        """See ``Estimator.update``. The plan's prediction is not used: the filter has a model of its own.

        Where the filter cannot go on, the estimator begins anew, with vehicles that may move in any way.
        """
        try:
            return self._updated(measurements, applied)
        except np.linalg.LinAlgError as error:
            self._timeline, self.belief = None, None
            self._start = self._new_start(is_at_rest=False)
            self._restarts += 1
            return Waiting(f"estimate, which begins anew: {error}")

    def _new_start(self, *, is_at_rest: bool) -> TeamStart:
        first = team_noise.first_belief(is_at_rest=is_at_rest, has_nominal_inertia=self._has_nominal_inertia)
        return TeamStart(self._vehicles, self._filter, self._builder, self._hover, self._yaw_std_max, first)

    def _updated(
        self, measurements: TeamMeasurements, applied: Mapping[int, AppliedInputs]
    ) -> TeamEstimate | Waiting:
        now_ns = measurements.arrival_ns
        if self._timeline is None:
            first = self._start.update(measurements)
            if isinstance(first, Waiting):
                return first
            self._timeline = self._timeline_from(first)
        for start_ns, inputs in applied.items():
            self._timeline.command(start_ns, inputs)
        self._findings = _Findings(set())
        for name in self._vehicles:
            for sensor, arrived in measurements.by_vehicle[name].by_sensor.items():
                for measurement in arrived:
                    self._timeline.measure(measurement.stamp_ns, (name, sensor), measurement)
                    if sensor == RANGE_BEARING.name:
                        self._findings.fresh.add((measurement.stamp_ns, name))
        known = self._timeline.come_forward(now_ns, self._correct, self._predict)
        if not np.isfinite(known.belief.states).all():
            raise np.linalg.LinAlgError("the states of the team are not finite")
        self._timeline.forget(now_ns - HISTORY_STEPS * self._period_ns)
        self._health.note(measurements)
        if known.rotors.lag != self._rotor_lag:
            self._findings.contradictions.append(
                f"rotors lag by {known.rotors.lag.time_constant} s, not {self._rotor_lag.time_constant} s"
            )
            self._rotor_lag = known.rotors.lag
        self.belief = known.belief
        return self._estimate(now_ns, known.belief)

    def _timeline_from(self, first: FirstBelief) -> Timeline[_Known, AppliedInputs]:
        memory = Memory.empty(len(self._vehicles), len(self._pairs))
        hover = AppliedInputs(self._hover, np.zeros_like(self._hover))
        timeline = Timeline(
            first.stamp_ns,
            _Known(first.belief, memory, hover, self._lag_finder.start(self._hover)),
            hover,
        )
        for key, measurement in first.measured.items():
            timeline.measure(first.stamp_ns, key, measurement)
        return timeline

    def _predict(self, known: _Known, inputs: AppliedInputs | None, duration_ns: int) -> _Known:
        """What is known after an interval without measurements."""
        inputs = known.inputs if inputs is None else inputs
        duration = duration_ns / NANOSECONDS_PER_SECOND
        mean = known.rotors.lag.mean(known.thrusts, inputs.thrusts, duration)
        speeds = np.linalg.norm(known.belief.states[:, layout.VELOCITY], axis=1, keepdims=True)
        noise = self._noise.variances(mean, duration, self._body, speeds)
        belief = self._filter.predict(known.belief, mean, duration, noise)
        if inputs.doubt.any():
            other = self._filter.predict(known.belief, mean + inputs.doubt, duration, noise)
            belief = belief.widened(team_noise.doubted(other.states - belief.states))
        rotors = self._lag_finder.commanded(known.rotors, inputs.thrusts, duration)
        return _Known(belief, known.memory, inputs, rotors)

    def _correct(self, known: _Known, stamp_ns: int, measured: Measured) -> _Known:
        """What is known after the measurements of an instant."""
        if not measured:
            return known
        memory, observation = known.memory, self._builder.build(measured)
        innovation = self._filter.innovation(known.belief, known.thrusts, observation)
        belief, innovation, drift = self._follow_changes(known, observation, innovation)
        belief, innovation, misfits = self._check_localization(known, belief, observation, innovation)
        seen = np.asarray(observation.sighting_weights.any(axis=(1, 2)))
        rejected = team_monitor.outlying_sightings(innovation, seen, self._opposite)
        runs, contradictions = team_monitor.runs_of_rejections(innovation, rejected, seen, memory)
        self._note_sightings(stamp_ns, seen, rejected, innovation.sighting_distances)
        if rejected.any() and self._options.gates_sightings:
            innovation = innovation.without(rejected)
        belief = self._filter.correct(belief, innovation)
        for vehicle in team_monitor.misplaced_vehicles(runs, seen, self._pairs):
            belief = self._placed_again(belief, vehicle, measured)
            runs = np.where([vehicle in pair for pair in self._pairs], 0, runs)
        memory = Memory(drift, runs, contradictions, misfits)
        return _Known(belief, memory, known.inputs, self._with_turns(known.rotors, measured))

    def _follow_changes(
        self, known: _Known, observation: Observation, innovation: Innovation
    ) -> tuple[Belief, Innovation, Array]:
        """Belief and innovation with uncertain forces and torques where they changed; new drift."""
        belief = known.belief
        forces, drift = team_monitor.force_changes(innovation, known.memory.drift)
        torques = team_monitor.torque_changes(innovation)
        if (forces | torques).any() and self._options.detects_changes:
            specific_thrusts = known.thrusts.sum(axis=1) / self._body.mass
            period = self._period_ns / NANOSECONDS_PER_SECOND
            belief = belief.widened(
                team_noise.changes(belief.states, forces, torques, specific_thrusts, period)
            )
            observation.own[forces, team_model.FORCE_ROWS] = team_noise.USUAL_FORCES
            observation.own_weights[forces, team_model.FORCE_ROWS] = 1.0 / team_noise.USUAL_FORCES_STD
            innovation = self._filter.innovation(belief, known.thrusts, observation)
        return belief, innovation, drift

    def _check_localization(
        self, known: _Known, belief: Belief, observation: Observation, innovation: Innovation
    ) -> tuple[Belief, Innovation, int]:
        """Ignore a fix that does not fit, or let the team follow it after a run of these; new misfits."""
        if not team_monitor.localization_misfits(innovation):
            return belief, innovation, 0
        misfits = known.memory.misfits + 1
        if misfits < team_monitor.RUN:
            self._findings.contradictions.append(f"localization of {self._vehicles[0]} does not fit")
            observation.own_weights[0, team_model.LOCALIZATION_ROWS] = 0.0
        else:
            misfits = 0
            self._findings.contradictions.append(f"localization of {self._vehicles[0]} has jumped")
            belief = team_restart.unanchored(belief)
        return belief, self._filter.innovation(belief, known.thrusts, observation), misfits

    def _with_turns(self, rotors: LagEvidence, measured: Measured) -> LagEvidence:
        """What is known of the rotors after the attitudes of an instant."""
        imus = {
            self._vehicles.index(name): imu for (name, _), imu in measured.items() if isinstance(imu, Imu)
        }
        if rotors.is_decided or not imus:
            return rotors
        q_NB = np.array([imu.q_NB for imu in imus.values()])
        variances = np.array([imu.attitude_covariance[0, 0] for imu in imus.values()])
        return self._lag_finder.measured(rotors, list(imus), q_NB, variances)

    def _placed_again(self, belief: Belief, vehicle: int, measured: Measured) -> Belief:
        """The belief with a vehicle placed by mutual sightings with another, if there are such."""
        name = self._vehicles[vehicle]
        sightings = {
            (observer, target): seen
            for (observer, _), bearings in measured.items()
            if isinstance(bearings, RangeBearings)
            for target, seen in bearings.by_target.items()
        }
        for other, other_name in enumerate(self._vehicles):
            by_other, by_it = sightings.get((other_name, name)), sightings.get((name, other_name))
            if by_other is None or by_it is None:
                continue
            placed = team_restart.placed_again(belief, other, vehicle, by_other, by_it)
            if placed is not None:
                self._findings.contradictions.append(f"{name} was placed again by {other_name}'s sightings")
                return placed
        return belief

    def _note_sightings(self, stamp_ns: int, seen: Mask, rejected: Mask, distances: Array) -> None:
        """Count what is new in this update: a late message repeats the corrections that follow it."""
        findings = self._findings
        for (i, j), is_seen, is_rejected, distance in zip(
            self._pairs, seen.tolist(), rejected.tolist(), distances.tolist(), strict=True
        ):
            observer = self._vehicles[i]
            if not is_seen or (stamp_ns, observer) not in findings.fresh:
                continue
            if is_rejected:
                findings.rejected.append(f"range and bearing from {observer} to {self._vehicles[j]}")
            else:
                findings.nis += distance
                findings.n_sightings += 1

    def _estimate(self, now_ns: int, belief: Belief) -> TeamEstimate:
        """The belief in the {mi} frames of the vehicles, and what was found in this step."""
        states, geometry, covariances = self._filter.geometry(belief)
        found = self._findings
        mode, reason = self._health.judge(now_ns, found.contradictions)
        return TeamEstimate(
            states,
            geometry,
            covariances.pairs[:, 3, 3],
            tuple(
                not self._health.see_each_other(self._vehicles[i], self._vehicles[j]) for i, j in self._pairs
            ),
            EstimatorReport(
                mode,
                reason,
                nis=found.nis if found.n_sightings else np.nan,
                nis_dof=found.n_sightings * team_model.N_SIGHT_ROWS,
                rejected=tuple(found.rejected),
                restarts=self._restarts,
            ),
            self._start.unsettled(now_ns, covariances),
            covariances,
            self._rotor_lag,
        )
