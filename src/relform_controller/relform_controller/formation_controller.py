"""The formation controller: measurements of the team in, rotor speeds for the team out."""

import dataclasses
import math
import time
from collections.abc import Callable, Mapping

import numpy as np

from relform_controller.ahead import predict_ahead
from relform_controller.estimation.estimator import Estimator, TeamEstimate, Waiting
from relform_controller.estimation.registry import make_estimator
from relform_controller.input_log import InputLog
from relform_controller.ocp.frames import wrap_angle
from relform_controller.ocp.problem import (
    HorizonReference,
    HorizonStart,
    Ocp,
    Prediction,
)
from relform_controller.ocp.rotor_lag import RotorLag
from relform_controller.reference.form_up import StartPoses
from relform_controller.reference.mission import Mission, MissionReference, ScenarioMission
from relform_controller.reference.resumed_mission import ResumedMission
from relform_controller.solver.algorithm import ModifiedRti
from relform_controller.solver.make import make_solver
from relform_controller.solver.prediction import predictor
from relform_controller.solver.solver import Solver
from relform_controller.take_over import GAP_MAX_S, take_over_problem
from relform_controller.watch import Watch
from relform_core.arrays import Array
from relform_core.blend import Blend
from relform_core.controller_config import WeightsConfig
from relform_core.errors import FlightError
from relform_core.measurements import RotorCommand, TeamMeasurements
from relform_core.names import SolverState
from relform_core.scenario_config import ScenarioConfig
from relform_core.schema import Vector3
from relform_core.telemetry import (
    Decision,
    LeaderEstimate,
    PairEstimate,
    SolverReport,
    Standby,
    TeamReference,
    TeamState,
)
from relform_core.units import seconds_to_ns


class FormationController:
    """Central controller of the team.

    `feedback` turns the measurements of one step into commands; `prepare_next` does, after the commands are
    out, what can be done before the next measurements. `step` does both.

    Commands need some time to arrive, of which the configuration knows the longest. The controller predicts
    the team over that time, whole control periods, with the commands that are under way; it plans from there
    on, and its commands are for the interval that begins then.

    While the solver fails, the commands are what is left of the last plan that it found. When that is over,
    there are none: the vehicles stop safely on their own sensors, until the solver succeeds again.

    While the estimator waits for its first measurements, there are no commands and the vehicles hover. While
    its first estimates are not accurate enough yet, the controller holds the team where it is. Then the
    mission starts: the team forms up from there, and the leader flies its path.

    Args:
        config: the scenario; of what it says about the vehicles the controller knows the nominal values only.
        clock: monotonic time [s], for the solver's reports.
        mission: what the team is asked to fly; None: the phases of the scenario.
        estimator: None: the one that the configuration names.
        solver: makes what takes the SQP steps of the problem.
        time_budget: time after which no further SQP step of a decision begins [s]; infinite in lock-step, so
            that decisions do not depend on the machine.
    """

    def __init__(
        self,
        config: ScenarioConfig,
        clock: Callable[[], float] = time.perf_counter,
        mission: Mission | None = None,
        estimator: Estimator | None = None,
        solver: Callable[[Ocp], Solver] = make_solver,
        time_budget: float = math.inf,
    ) -> None:
        self._vehicles = config.team.vehicles
        self._period_ns = config.period_ns
        self._lead_ns = config.command_lead_ns
        self._thrust_coefficient = config.vehicle.thrust_coefficient
        self._scenario = config
        self._config = config.controller
        self._forms_up = config.ground is not None
        """Whether the mission starts from where the vehicles are, even if nothing has to be waited for."""
        self._resumes = False
        """Whether the mission is that of a flight which another controller has begun."""
        self._mission = ScenarioMission(config) if mission is None else mission
        self._estimator = make_estimator(config) if estimator is None else estimator
        self._ocp = dataclasses.replace(
            Ocp.from_config(config), is_disturbed=self._estimator.estimates_disturbances
        )
        self._pair_names = [(self._vehicles[i], self._vehicles[j]) for i, j in self._ocp.pairs]
        """Observer and target of every pair."""
        self._predict = predictor(self._ocp)
        self._make_solver: Callable[[], ModifiedRti] = lambda: ModifiedRti(
            self._ocp,
            solver(self._ocp),
            self._predict,
            config.controller.solver,
            config.vehicle.hover_thrust,
            clock,
            time_budget,
        )
        self._solver = self._make_solver()
        self._weights: WeightsConfig | None = None
        """None: those of the scenario."""
        stage_ns = seconds_to_ns(self._ocp.stage)
        horizon_ns = self._lead_ns + np.arange(self._ocp.n_stages + 1) * stage_ns
        self._asked_ns = np.concatenate([[0], horizon_ns])
        """Now, then the stages of the horizon."""
        n_intervals = self._ocp.n_stages * stage_ns // self._period_ns
        self._stage_of_interval = np.arange(n_intervals) * self._period_ns // stage_ns
        """Which stage's input a command applies in each control period of the horizon."""
        self._planned_until_ns = 0
        """End of the horizon of the last plan that was solved for."""
        self._prediction: Prediction | None = None
        self._estimated: tuple[int, TeamEstimate] | None = None
        """The last instant with an estimate [ns], and the estimate."""
        self._carried_to_ns = 0
        """The instant to which plan and mission were carried, with an estimate or without [ns]."""
        self._watch = Watch(config)
        self._holds_inside = config.geofence is not None and config.geofence.reaction == "hold"
        self._is_outside = False
        """Whether a vehicle was outside the geofence in the last decision."""
        self._rotor_lag = RotorLag(config.vehicle.rotor_time_constant)
        self._inputs = InputLog(self._vehicles, self._period_ns, config.vehicle)
        self._waiting_since_ns: int | None = None
        self._mission_start_ns: int | None = None

    @property
    def formation(self) -> Mapping[str, Vector3]:
        """What the team flies: position of each follower relative to the leader, without ramp [m]."""
        return self._mission.formation

    def resume(self) -> None:
        """Take over a team in flight, of which nothing is known, in the next step.

        The team holds its place as at every start, then it forms up and goes on with the phase of that time.
        """
        self._mission = ResumedMission(self._scenario)
        self._estimator = make_estimator(self._scenario, is_at_rest=False)
        self._forms_up = self._resumes = True
        self._solver = self._make_solver()
        if self._weights is not None:
            self._solver.set_weights(self._weights)
        self._planned_until_ns = 0
        self._prediction = self._estimated = None
        self._rotor_lag = RotorLag(self._scenario.vehicle.rotor_time_constant)
        self._inputs = InputLog(self._vehicles, self._period_ns, self._scenario.vehicle)
        self._waiting_since_ns = self._mission_start_ns = None

    def set_weights(self, weights: WeightsConfig) -> None:
        """Change the weights of the cost from the next step on."""
        self._weights = weights
        self._solver.set_weights(weights)

    def way_to(self, formation: Mapping[str, Vector3]) -> Blend:
        """The way of all vehicles to a formation from the next step on; see ``Mission``."""
        return self._mission.way_to(formation)

    def check_formation(self, formation: Mapping[str, Vector3]) -> None:
        """Check a request without making it; arguments and errors are those of ``set_formation``."""
        self._mission.check_formation(formation)

    def set_formation(self, formation: Mapping[str, Vector3]) -> None:
        """Fly another formation from the next step on, until the mission changes it.

        Args:
            formation: position of each follower relative to the leader [m].
        Raises:
            ConfigError: the team cannot fly it.
        """
        self._mission.set_formation(formation)

    def step(self, measurements: TeamMeasurements, sqp_steps: int | None = None) -> Decision | Standby:
        """`feedback`, then `prepare_next` if there was a decision."""
        decision = self.feedback(measurements, sqp_steps)
        if isinstance(decision, Decision):
            self.prepare_next()
        return decision

    def feedback(self, measurements: TeamMeasurements, sqp_steps: int | None = None) -> Decision | Standby:
        """Decide on the rotor speeds of the next interval that commands reach in time.

        Args:
            measurements: of all vehicles, at the instant of the next step, or of a later one: then the
                vehicles fly the last plan meanwhile.
            sqp_steps: number of SQP steps to take, as a recorded flight did; None: as the limits allow.
        Returns:
            The decision; at the start of a flight what the controller waits for, if there is no estimate yet.
        Raises:
            FlightError: the start still waits after ``controller.start_wait_max_s``, or the team cannot form
                up from where it is, or is to be taken over but is not in the air.
        """
        now_ns = measurements.arrival_ns
        if self._has_missed_too_much(now_ns):
            self.resume()
        if self._resumes and self._mission_start_ns is None:
            _check_in_the_air(measurements)
        self._skip_to(now_ns)
        self._inputs.acknowledge(measurements)
        estimate = self._estimator.update(measurements, self._inputs.take_changes(now_ns), self._prediction)
        if isinstance(estimate, Waiting):
            self._check_wait(now_ns, estimate.reason)
            return Standby(estimate.reason)
        asked = self._asked(now_ns, estimate)
        if self._mission_start_ns is not None:
            self._waiting_since_ns = None
        reference = HorizonReference(asked.p_B1B2_C1[:, 1:], asked.leader.p_NB_N[1:], asked.leader.yaw_NB[1:])
        estimate = _unwrapped(estimate, float(asked.leader.yaw_NB[0]))
        self._estimated = now_ns, estimate
        self._carried_to_ns = now_ns
        if estimate.rotor_lag is not None:
            self._rotor_lag = estimate.rotor_lag
        start_ns = now_ns + self._lead_ns
        predicted = self._predicted(start_ns)
        start = HorizonStart(
            predicted.states,
            self._inputs.rotors(start_ns, self._rotor_lag),
            self._inputs.thrusts(start_ns - self._period_ns),
        )
        plan, report = self._solver.solve(start, predicted.geometry, reference, sqp_steps)
        stage_of_interval = self._stage_of_interval
        if report.state is SolverState.FALLBACK:
            n_left = max(0, self._planned_until_ns - start_ns) // self._period_ns
            stage_of_interval = stage_of_interval[:n_left]
        else:
            self._planned_until_ns = start_ns + len(stage_of_interval) * self._period_ns
        planned = plan.thrusts[:, stage_of_interval]
        if len(stage_of_interval):
            self._inputs.command(start_ns, planned)
        decision = self._decision(measurements, estimate, asked, planned, report)
        decision = self._watch.watched(decision, measurements, estimate, predicted.geometry, plan)
        if decision.breach and not self._is_outside and self._holds_inside:
            self._mission.halt()
        self._is_outside = bool(decision.breach)
        return decision

    def prepare_next(self) -> None:
        """Shift and transform the plan into the {mi} frames of the next step, and prepare its first SQP step.

        Raises:
            RuntimeError: there was no decision yet.
        """
        self._prediction = self._solver.prepare_next()
        if self._lead_ns > 0 and self._estimated is not None:  # the plan starts later
            self._prediction = self._predicted(self._estimated[0] + self._period_ns)

    def _has_missed_too_much(self, now_ns: int) -> bool:
        """Whether the last step is too long ago to go on from it; a flight director sees to it itself."""
        if self._estimated is None or not isinstance(self._mission, ScenarioMission):
            return False
        return now_ns - self._carried_to_ns > seconds_to_ns(GAP_MAX_S)

    def _skip_to(self, now_ns: int) -> None:
        """Carry the last plan over the steps without a decision between the last one and this instant."""
        if self._estimated is None:
            return
        skipped_ns = range(self._carried_to_ns + self._period_ns, now_ns, self._period_ns)
        for instant_ns in skipped_ns:
            self._inputs.plan_continues(instant_ns + self._lead_ns)
            if self._mission_start_ns is not None:
                self._mission.advance(instant_ns - self._mission_start_ns)
        if skipped_ns:
            self._carried_to_ns = skipped_ns[-1]
            self._prediction = self._solver.skip(len(skipped_ns))
            if self._lead_ns > 0:
                self._prediction = self._predicted(now_ns)

    def _predicted(self, start_ns: int) -> Prediction:
        """The team at an instant after the last estimate, whole control periods later."""
        assert self._estimated is not None
        now_ns, estimate = self._estimated
        if start_ns == now_ns:
            return Prediction(estimate.states, estimate.geometry)
        thrusts = self._inputs.mean_thrusts(now_ns, start_ns, self._rotor_lag)
        return predict_ahead(estimate.states, estimate.geometry, thrusts, self._predict, self._ocp.pairs)

    def _asked(self, now_ns: int, estimate: TeamEstimate) -> MissionReference:
        """What to track over the horizon; before the mission starts, the team stays where it is."""
        if self._mission_start_ns is None:
            if estimate.unsettled or self._forms_up:
                self._mission.hold(StartPoses.seen_by_leader(estimate.geometry))
            if estimate.unsettled:
                self._check_wait(now_ns, estimate.unsettled)
                return self._mission.reference(np.zeros_like(self._asked_ns))
            self._mission_start_ns = 0 if self._resumes else now_ns
        mission_ns = now_ns - self._mission_start_ns
        self._mission.advance(mission_ns)
        return self._mission.reference(mission_ns + self._asked_ns)

    def _check_wait(self, now_ns: int, missing: str) -> None:
        """Raise FlightError if the flight has waited too long for an estimate that it can be flown on."""
        if self._waiting_since_ns is None:
            self._waiting_since_ns = now_ns
        waited_ns, bound = now_ns - self._waiting_since_ns, self._config.start_wait_max
        if waited_ns >= seconds_to_ns(bound):
            goal = "start" if self._mission_start_ns is None else "go on"
            raise FlightError(
                f"the flight cannot {goal}: after {bound:g} s (controller.start_wait_max_s) there is still "
                f"no {missing}"
            )

    def _decision(
        self,
        measurements: TeamMeasurements,
        estimate: TeamEstimate,
        asked: MissionReference,
        planned: Array,
        report: SolverReport,
    ) -> Decision:
        speeds = np.sqrt(planned / self._thrust_coefficient)
        start_ns = measurements.arrival_ns + self._lead_ns
        leader, formation = asked.leader, asked.p_B1B2_C1__target
        names = self._pair_names
        geometry, covariances = estimate.geometry, estimate.covariances
        yaws, yaw_variances = geometry.yaw_I1I2.tolist(), estimate.yaw_variances.tolist()
        yaw_variance_max = self._config.relative_yaw_std_max**2
        return Decision(
            step=measurements.step,
            stamp_ns=measurements.arrival_ns,
            commands={
                name: RotorCommand(start_ns, self._period_ns, speeds[vehicle, 0], speeds[vehicle, 1:])
                for vehicle, name in enumerate(self._vehicles if speeds.shape[1] else ())
            },
            solver=report,
            state=TeamState(
                phase=asked.phase,
                pairs=tuple(
                    PairEstimate(
                        observer=observer,
                        target=target,
                        # {mi} and {mc} coincide at the start of the horizon.
                        p_B1B2_C1__est=geometry.p_I1I2_I1[pair],
                        p_B1B2_C1__ref=formation[pair],
                        yaw_I1I2=yaws[pair],
                        yaw_variance=yaw_variances[pair],
                        yaw_held=estimate.yaw_held[pair],
                        yaw_singular=yaw_variances[pair] > yaw_variance_max,
                        covariance=None if covariances is None else covariances.pairs[pair],
                    )
                    for pair, (observer, target) in enumerate(names)
                ),
                leader_position_error=float(np.linalg.norm(geometry.p_NI_N - leader.p_NB_N[0])),
                leader_yaw_error=wrap_angle(geometry.yaw_NI - float(leader.yaw_NB[0])),
                leader=LeaderEstimate(
                    geometry.p_NI_N, geometry.yaw_NI, None if covariances is None else covariances.leader
                ),
                estimator=estimate.report,
            ),
            reference=TeamReference(
                phase=asked.phase,
                p_NB_N=leader.p_NB_N[0],
                v_NB_N=leader.v_NB_N[0],
                yaw_NB=float(leader.yaw_NB[0]),
                formation=dict(zip(names, formation, strict=True)),
            ),
            holds_for=estimate.unsettled if self._mission_start_ns is None else "",
        )


def _check_in_the_air(measurements: TeamMeasurements) -> None:
    """Raise FlightError if a vehicle is on the ground, or nearly so."""
    for name, measured in measurements.by_vehicle.items():
        if problem := take_over_problem(name, measured):
            raise FlightError(f"the team cannot be taken over: {problem}")


def _unwrapped(estimate: TeamEstimate, yaw_reference: float) -> TeamEstimate:
    """The same estimate with the leader's yaw within half a turn of its reference."""
    geometry = estimate.geometry
    yaw_NI = yaw_reference + wrap_angle(geometry.yaw_NI - yaw_reference)
    return dataclasses.replace(estimate, geometry=dataclasses.replace(geometry, yaw_NI=yaw_NI))
