"""The formation controller: measurements of the team in, rotor speeds for the team out."""

import time
from collections.abc import Callable, Mapping

import numpy as np

from relform_controller.estimation.raw_feedback import Feedback, Prediction, RawFeedback
from relform_controller.ocp import layout
from relform_controller.ocp.frames import wrap_angle
from relform_controller.ocp.problem import HorizonReference, Ocp, Plan, TeamGeometry
from relform_controller.reference.mission import Mission, MissionReference, ScenarioMission
from relform_controller.solver.algorithm import ModifiedRti
from relform_controller.solver.kernels import Kernels
from relform_controller.solver.warm_start import hover_plan, shift, transform
from relform_core.controller_config import WeightsConfig
from relform_core.measurements import RotorCommand, TeamMeasurements
from relform_core.scenario_config import ScenarioConfig
from relform_core.schema import Vector3
from relform_core.telemetry import Decision, PairEstimate, SolverReport, TeamReference, TeamState


class FormationController:
    """Central controller of the team.

    `feedback` turns the measurements of one step into commands; `prepare_next` does, after the commands are
    out, what can be done before the next measurements. `step` does both.

    Args:
        config: the scenario; of what it says about the vehicles the controller knows the nominal values only.
        clock: monotonic time [s], for the solver's reports.
        mission: what the team is asked to fly; None: the phases of the scenario.
    """

    def __init__(
        self,
        config: ScenarioConfig,
        clock: Callable[[], float] = time.perf_counter,
        mission: Mission | None = None,
    ) -> None:
        self._vehicles = config.team.vehicles
        self._period_ns = config.period_ns
        self._thrust_coefficient = config.vehicle.thrust_coefficient
        self._hover_thrust = config.vehicle.hover_thrust
        self._warm_start = config.controller.solver.warm_start
        self._ocp = Ocp.from_config(config)
        self._kernels = Kernels(self._ocp)
        self._solver = ModifiedRti(self._ocp, self._kernels, config.controller.solver, clock)
        self._mission = ScenarioMission(config) if mission is None else mission
        self._horizon_ns = np.arange(self._ocp.n_stages + 1) * self._period_ns
        self._raw_feedback = RawFeedback(
            self._vehicles, config.controller.relative_yaw_std_max, config.controller.period
        )
        self._plan: Plan | None = None
        self._geometry: TeamGeometry | None = None
        self._guess: Plan | None = None
        self._prediction: Prediction | None = None
        self._applied_thrusts = np.full((self._ocp.n_vehicles, layout.N_INPUT), self._hover_thrust)
        self._requested_weights: WeightsConfig | None = None

    @property
    def formation(self) -> Mapping[str, Vector3]:
        """What the team flies: position of each follower relative to the leader, without ramp [m]."""
        return self._mission.formation

    def set_weights(self, weights: WeightsConfig) -> None:
        """Weigh the terms of the cost otherwise from the next step on."""
        self._requested_weights = weights

    def set_formation(self, formation: Mapping[str, Vector3]) -> None:
        """Fly another formation from the next step on, until the mission changes it.

        Args:
            formation: position of each follower relative to the leader [m].
        Raises:
            ConfigError: the team cannot fly it.
        """
        self._mission.set_formation(formation)

    def step(self, measurements: TeamMeasurements, sqp_steps: int | None = None) -> Decision:
        """`feedback`, then `prepare_next`."""
        decision = self.feedback(measurements, sqp_steps)
        self.prepare_next()
        return decision

    def feedback(self, measurements: TeamMeasurements, sqp_steps: int | None = None) -> Decision:
        """Decide on the rotor speeds of the interval that starts at the instant of the measurements.

        Args:
            measurements: of all vehicles at one instant.
            sqp_steps: number of SQP steps to take, as a recorded flight did; None: as the limits allow.
        Raises:
            FlightError: the first measurements do not suffice to start.
        """
        self._mission.advance(measurements.arrival_ns)
        asked = self._mission.reference(measurements.arrival_ns + self._horizon_ns)
        reference = HorizonReference(asked.p_B1B2_C1, asked.leader.p_NB_N, asked.leader.yaw_NB)
        feedback = self._raw_feedback.update(measurements, float(asked.leader.yaw_NB[0]), self._prediction)
        self._apply_weights()
        guess = self._guess
        if guess is None or self._warm_start == "cold":
            guess = hover_plan(feedback.initial_states, self._hover_thrust, self._ocp.n_stages)
            self._solver.prepare(guess, feedback.geometry)
        self._plan, report = self._solver.solve(
            guess, feedback.initial_states, feedback.geometry, reference, self._applied_thrusts, sqp_steps
        )
        self._geometry = feedback.geometry
        self._applied_thrusts = self._plan.thrusts[:, 0]
        return self._decision(measurements, feedback, asked, report)

    def prepare_next(self) -> None:
        """Shift and transform the plan into the {mi} frames of the next step, and prepare its first SQP step.

        Raises:
            RuntimeError: there was no feedback yet.
        """
        if self._plan is None or self._geometry is None:
            raise RuntimeError("prepare_next() needs a feedback() before it")
        shifted = shift(self._plan, self._kernels)
        transformed, geometry = transform(shifted, self._geometry, self._ocp.pairs)
        self._prediction = Prediction(transformed.states[:, 0], geometry)
        match self._warm_start:
            case "transform":
                self._guess = transformed
            case "shift":
                self._guess = shifted
            case "hold":
                self._guess = self._plan
            case "cold":  # there is nothing to prepare before the measurement
                return
        self._solver.prepare(self._guess, geometry)

    def _apply_weights(self) -> None:
        """Change the weights if that was asked for; what was prepared has to be prepared again with them."""
        if self._requested_weights is None:
            return
        self._solver.set_weights(self._requested_weights)
        self._requested_weights = None
        if self._guess is not None and self._prediction is not None:
            self._solver.prepare(self._guess, self._prediction.geometry)

    def _decision(
        self,
        measurements: TeamMeasurements,
        feedback: Feedback,
        asked: MissionReference,
        report: SolverReport,
    ) -> Decision:
        assert self._plan is not None
        speeds = np.sqrt(self._plan.thrusts / self._thrust_coefficient)
        leader, formation = asked.leader, asked.p_B1B2_C1__target
        names = [(self._vehicles[i], self._vehicles[j]) for i, j in self._ocp.pairs]
        return Decision(
            step=measurements.step,
            stamp_ns=measurements.arrival_ns,
            commands={
                name: RotorCommand(
                    measurements.arrival_ns, self._period_ns, speeds[vehicle, 0], speeds[vehicle, 1:]
                )
                for vehicle, name in enumerate(self._vehicles)
            },
            solver=report,
            state=TeamState(
                phase=asked.phase,
                pairs=tuple(
                    PairEstimate(
                        observer=observer,
                        target=target,
                        # {mi} and {mc} coincide at the start of the horizon.
                        p_B1B2_C1__est=feedback.geometry.p_I1I2_I1[pair],
                        p_B1B2_C1__ref=formation[pair],
                        yaw_I1I2=feedback.yaw_estimates[pair].yaw,
                        yaw_variance=feedback.yaw_estimates[pair].variance,
                        yaw_held=feedback.yaw_held[pair],
                    )
                    for pair, (observer, target) in enumerate(names)
                ),
                leader_position_error=float(np.linalg.norm(feedback.geometry.p_NI_N - leader.p_NB_N[0])),
                leader_yaw_error=wrap_angle(feedback.geometry.yaw_NI - float(leader.yaw_NB[0])),
            ),
            reference=TeamReference(
                phase=asked.phase,
                p_NB_N=leader.p_NB_N[0],
                v_NB_N=leader.v_NB_N[0],
                yaw_NB=float(leader.yaw_NB[0]),
                formation=dict(zip(names, formation, strict=True)),
            ),
        )
