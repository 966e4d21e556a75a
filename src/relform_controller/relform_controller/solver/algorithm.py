"""Algorithm MRTI, the modified real-time iteration: the guess, the number of SQP steps, and the fallback."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from relform_controller.compiled import CompiledFunction
from relform_controller.ocp.problem import HorizonReference, HorizonStart, Ocp, Plan, Prediction, TeamGeometry
from relform_controller.solver.solver import QpError, Solver, SqpStep
from relform_controller.solver.warm_start import hover_plan, shift, transform
from relform_core.arrays import Array
from relform_core.controller_config import SolverConfig, WeightsConfig
from relform_core.names import SolverState
from relform_core.telemetry import SolverReport


@dataclass(frozen=True)
class _Limits:
    """When the SQP steps from one guess are enough."""

    tolerance: float
    """Of the KKT value."""
    steps: int
    deadline: float
    """No step but the first begins later [s]."""


@dataclass
class _Iteration:
    """SQP steps from one guess."""

    steps: list[SqpStep] = field(default_factory=list)
    """Those that succeeded."""
    begun: int = 0
    failure: str = ""
    """Why the last one that was begun failed; empty: none did."""


class ModifiedRti:
    """Solves the team's problem once per control step: ``solve``, then ``prepare_next``.

    The first step of a flight iterates from a hover at the measured states until the KKT value is low. Every
    later step starts from the plan of the step before, shifted and transformed.

    The control step starts again, from a hover, if an SQP step from the plan fails, or if the KKT value grows
    from one to the next: the steps diverge, because the plan is too far from the measured states. Of all
    steps from a hover, that with the lowest KKT value is flown. If none succeeds, or if the time is up, the
    plan of the control step before is flown, and the next one starts from a hover.

    Args:
        ocp: the problem.
        solver: takes the SQP steps.
        predict: (state, mean thrusts, disturbance if there is one) -> (state one control period later,), of
            all vehicles.
        config: limits on the number of SQP steps, tolerances, and the kind of warm start.
        hover_thrust: thrust of each rotor in the first guess [N].
        clock: monotonic time [s], for the reports and the time budget only.
        time_budget: time after which no further SQP step of a control step starts [s]; infinite in
            lock-step, so that results do not depend on the machine.
    """

    def __init__(
        self,
        ocp: Ocp,
        solver: Solver,
        predict: CompiledFunction,
        config: SolverConfig,
        hover_thrust: float,
        clock: Callable[[], float],
        time_budget: float = math.inf,
    ) -> None:
        self._ocp = ocp
        self._solver = solver
        self._predict = predict
        self._config = config
        self._hover_thrust = hover_thrust
        self._clock = clock
        self._time_budget = time_budget
        self._prepare_time = 0.0
        self._prepare_failure = ""
        self._started = False
        """Whether the next control step may start from the plan of the last one."""
        self._solved: tuple[Plan, TeamGeometry] | None = None
        """The plan of the last control step, and the frames that it is expressed in."""
        self._following: tuple[Plan, TeamGeometry] | None = None
        """The same, shifted and transformed to the next control step."""
        self._guess: Plan | None = None
        """What is prepared for the next control step; None: it starts from a hover."""

    def set_weights(self, weights: WeightsConfig) -> None:
        """Change the weights of the cost from the next control step on."""
        self._solver.set_weights(weights)
        if self._guess is not None and self._following is not None:
            self._prepare(self._guess, self._following[1])

    def solve(
        self,
        start: HorizonStart,
        geometry: TeamGeometry,
        reference: HorizonReference,
        sqp_steps: int | None = None,
    ) -> tuple[Plan, SolverReport]:
        """The plan for one estimate, or a fallback as the class describes it.

        Args:
            start: the vehicles as they are estimated to be.
            geometry: where the {mi} frames are estimated to be.
            reference: what to track.
            sqp_steps: number of SQP steps to begin, as in a recorded flight; None: as many as the limits
                allow.
        """
        is_from_hover = self._guess is None
        guess = self._guess or self._prepare_hover(start, geometry)
        measured = start, geometry, reference
        prepare_time, begin = self._prepare_time, self._clock()
        deadline = begin + self._time_budget
        limits = self._limits_in_flight(deadline) if self._started else self._limits_at_start()
        tries = [self._iterate(measured, limits, sqp_steps, must_fall=not is_from_hover)]
        if tries[0].failure and not is_from_hover:
            left = None if sqp_steps is None else sqp_steps - tries[0].begun
            if left != 0 and self._clock() < deadline:
                self._prepare_hover(start, geometry)
                limits, is_from_hover = self._limits_at_start(), True
                tries.append(self._iterate(measured, limits, left))
        found = tries[-1]
        flown, state = None, SolverState.FALLBACK
        if found.steps and (is_from_hover or not found.failure):
            flown = min(found.steps, key=lambda step: step.kkt)
            state = SolverState.SOLVED if flown.kkt < limits.tolerance else SolverState.STEP_LIMIT
        before = guess if self._following is None else self._following[0]
        plan = before if flown is None else flown.plan
        self._started = flown is not None
        self._solved = plan, geometry
        self._guess = None
        steps = [step for each in tries for step in each.steps]
        return plan, SolverReport(
            state=state,
            fallback_reason="; ".join(each.failure for each in tries if each.failure),
            objective=math.nan if flown is None else flown.objective,
            kkt_first=steps[0].kkt if steps else math.nan,
            kkt=math.nan if flown is None else flown.kkt,
            sqp_steps=sum(each.begun for each in tries),
            qp_iterations=sum(step.qp_iterations for step in steps),
            active_bounds=0 if flown is None else flown.active_bounds,
            active_constraints=() if flown is None else flown.active_constraints,
            prepare_time=prepare_time,
            feedback_time=self._clock() - begin,
        )

    def prepare_next(self) -> Prediction:
        """Shift and transform the plan to the next control step, and prepare its first SQP step.

        Returns:
            What the plan predicts for that step.
        Raises:
            RuntimeError: nothing was solved yet.
        """
        if self._solved is None:
            raise RuntimeError("prepare_next() needs a solve() before it")
        plan, geometry = self._solved
        disturbances = () if geometry.disturbances is None else (geometry.disturbances.inputs,)

        def predict(states: Array, thrusts: Array) -> tuple[Array, ...]:
            return self._predict(states, thrusts, *disturbances)

        shifted = shift(plan, predict, self._ocp)
        transformed, next_geometry = transform(shifted, geometry, self._ocp.pairs)
        self._following = transformed, next_geometry
        if self._started:
            match self._config.warm_start:
                case "transform":
                    self._guess = transformed
                case "shift":
                    self._guess = shifted
                case "hold":
                    self._guess = plan
                case "cold":  # there is nothing to prepare before the measurement
                    self._guess = None
        if self._guess is not None:
            self._prepare(self._guess, next_geometry)
        return Prediction(transformed.states[:, 0], next_geometry)

    def skip(self, n_periods: int) -> Prediction:
        """Prepare for a later control step, as ``prepare_next`` did for the next one.

        Args:
            n_periods: by how many control periods it is later; beyond the horizon the plan stays as it is.
        Raises:
            RuntimeError: ``prepare_next`` was not called before.
        """
        if self._following is None:
            raise RuntimeError("skip() needs a prepare_next() before it")
        prediction = Prediction(self._following[0].states[:, 0], self._following[1])
        for _ in range(min(n_periods, round(self._ocp.n_stages * self._ocp.stage / self._ocp.period))):
            self._solved = self._following
            prediction = self.prepare_next()
        return prediction

    def _prepare(self, guess: Plan, geometry: TeamGeometry) -> None:
        begin = self._clock()
        self._prepare_failure = ""
        try:
            self._solver.prepare(guess, geometry)
        except QpError as failure:
            self._prepare_failure = str(failure)
        self._prepare_time = self._clock() - begin

    def _prepare_hover(self, start: HorizonStart, geometry: TeamGeometry) -> Plan:
        hover = hover_plan(start, self._hover_thrust, self._ocp.n_stages)
        self._prepare(hover, geometry)
        return hover

    def _limits_at_start(self) -> _Limits:
        return _Limits(self._config.kkt_tolerance_start, self._config.sqp_steps_start_max, math.inf)

    def _limits_in_flight(self, deadline: float) -> _Limits:
        return _Limits(self._config.kkt_tolerance, self._config.sqp_steps_max, deadline)

    def _iterate(
        self,
        measured: tuple[HorizonStart, TeamGeometry, HorizonReference],
        limits: _Limits,
        imposed: int | None,
        must_fall: bool = False,
    ) -> _Iteration:
        """Take SQP steps from the prepared guess.

        Args:
            measured: the arguments of ``solve``.
            limits: on the steps.
            imposed: number of steps to begin instead, unless one fails; None: the limits hold.
            must_fall: whether a step fails whose KKT value is above that of the step before.
        """
        _, geometry, _ = measured
        iteration = _Iteration()
        steps = iteration.steps
        while True:
            iteration.begun += 1
            try:
                if steps:
                    self._solver.prepare(steps[-1].plan, geometry)
                elif self._prepare_failure:
                    raise QpError(self._prepare_failure)
                step = self._solver.feedback(*measured)
                if must_fall and steps and step.kkt > max(steps[-1].kkt, limits.tolerance):
                    raise QpError(f"SQP steps diverge: KKT value {steps[-1].kkt:.2g}, then {step.kkt:.2g}")
            except QpError as error:
                iteration.failure = str(error)
                return iteration
            steps.append(step)
            if imposed is not None:
                if iteration.begun >= imposed:
                    return iteration
            elif (
                step.kkt < limits.tolerance
                or iteration.begun >= limits.steps
                or self._clock() >= limits.deadline
            ):
                return iteration
