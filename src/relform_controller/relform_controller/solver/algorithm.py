"""Algorithm MRTI, the modified real-time iteration: the guess, the number of SQP steps, and the fallback."""

import math
from collections.abc import Callable

from relform_controller.compiled import CompiledFunction
from relform_controller.ocp.problem import HorizonReference, HorizonStart, Ocp, Plan, Prediction, TeamGeometry
from relform_controller.solver.solver import QpError, Solver, SqpStep
from relform_controller.solver.warm_start import hover_plan, shift, transform
from relform_core.arrays import Array
from relform_core.controller_config import SolverConfig, WeightsConfig
from relform_core.names import SolverState
from relform_core.telemetry import SolverReport


class ModifiedRti:
    """Solves the team's problem once per control step: ``solve``, then ``prepare_next``.

    The first step of a flight iterates from a hover at the measured states until the KKT value is low. Every
    later step starts from the plan of the step before, shifted and transformed. If an SQP step fails, the
    plan from before it is flown, and the next control step starts as the first one does. In a step that
    starts from a hover, the plan of the first SQP step is flown if only a later one fails.

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
            sqp_steps: number of SQP steps to take, as in a recorded flight; None: as many as the limits
                allow.
        """
        guess = self._guess
        if guess is None:
            guess = hover_plan(start, self._hover_thrust, self._ocp.n_stages)
            self._prepare(guess, geometry)
        begin = self._clock()
        tolerance = self._config.kkt_tolerance if self._started else self._config.kkt_tolerance_start
        steps: list[SqpStep] = []
        failure = self._prepare_failure
        while not failure:
            try:
                if steps:
                    self._solver.prepare(steps[-1].plan, geometry)
                steps.append(self._solver.feedback(start, geometry, reference))
            except QpError as error:
                failure = str(error)
            else:
                if self._is_enough(steps, tolerance, sqp_steps, begin):
                    break
        flown = steps[-1] if steps else None
        if not failure:
            state = SolverState.SOLVED if steps[-1].kkt < tolerance else SolverState.STEP_LIMIT
        elif steps and not self._started:
            # The further steps diverged, but the first one is sound: a hover is a good point to linearise at.
            flown, state = steps[0], SolverState.STEP_LIMIT
        else:
            state = SolverState.FALLBACK
        before = guess if self._following is None else self._following[0]
        plan = before if flown is None else flown.plan
        self._started = state is not SolverState.FALLBACK
        self._solved = plan, geometry
        self._guess = None
        return plan, SolverReport(
            state=state,
            fallback_reason=failure,
            objective=math.nan if flown is None else flown.objective,
            kkt_first=steps[0].kkt if steps else math.nan,
            kkt=math.nan if flown is None else flown.kkt,
            sqp_steps=len(steps),
            qp_iterations=sum(step.qp_iterations for step in steps),
            active_bounds=0 if flown is None else flown.active_bounds,
            prepare_time=self._prepare_time,
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

    def _prepare(self, guess: Plan, geometry: TeamGeometry) -> None:
        begin = self._clock()
        self._prepare_failure = ""
        try:
            self._solver.prepare(guess, geometry)
        except QpError as failure:
            self._prepare_failure = str(failure)
        self._prepare_time = self._clock() - begin

    def _is_enough(self, steps: list[SqpStep], tolerance: float, imposed: int | None, begin: float) -> bool:
        """Whether no further SQP step is to be taken."""
        if imposed is not None:
            return len(steps) >= imposed
        steps_max = self._config.sqp_steps_max if self._started else self._config.sqp_steps_start_max
        in_time = not self._started or self._clock() - begin < self._time_budget
        return steps[-1].kkt < tolerance or len(steps) >= steps_max or not in_time
