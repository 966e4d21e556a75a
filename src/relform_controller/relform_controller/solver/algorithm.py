"""Algorithm MRTI, the modified real-time iteration: how many SQP steps, and what if one fails."""

import math
from collections.abc import Callable

from relform_controller.ocp.problem import HorizonReference, Ocp, Plan, TeamGeometry
from relform_controller.solver.dense.box_qp import QpError
from relform_controller.solver.dense.rti import RealTimeIteration, SqpStep
from relform_controller.solver.kernels import Kernels
from relform_core.arrays import Array
from relform_core.controller_config import SolverConfig, WeightsConfig
from relform_core.names import SolverState
from relform_core.telemetry import SolverReport


class ModifiedRti:
    """Solves the team's problem once per control step.

    Args:
        ocp: the problem.
        kernels: its compiled functions.
        config: limits on the number of SQP steps and tolerances.
        clock: monotonic time [s], for the reports and the time budget only.
        time_budget: time after which no further SQP step of a control step starts [s]; infinite in
            lock-step, so that results do not depend on the machine.
    """

    def __init__(
        self,
        ocp: Ocp,
        kernels: Kernels,
        config: SolverConfig,
        clock: Callable[[], float],
        time_budget: float = math.inf,
    ) -> None:
        self._rti = RealTimeIteration(ocp, kernels)
        self._config = config
        self._clock = clock
        self._time_budget = time_budget
        self._prepare_time = 0.0
        self._prepare_failure = ""
        self._started = False

    def set_weights(self, weights: WeightsConfig) -> None:
        """Weigh the terms of the cost otherwise; ``prepare`` must follow."""
        self._rti.set_weights(weights)

    def prepare(self, guess: Plan, geometry: TeamGeometry) -> None:
        """Prepare the first SQP step of the next control step, in the geometry predicted for it."""
        begin = self._clock()
        self._prepare_failure = ""
        try:
            self._rti.prepare(guess, geometry)
        except QpError as failure:
            self._prepare_failure = str(failure)
        self._prepare_time = self._clock() - begin

    def solve(
        self,
        guess: Plan,
        initial_states: Array,
        geometry: TeamGeometry,
        reference: HorizonReference,
        applied_thrusts: Array,
        sqp_steps: int | None = None,
    ) -> tuple[Plan, SolverReport]:
        """The plan for what was measured; if an SQP step fails, what there was before it.

        Args:
            guess: what was prepared.
            initial_states: state of each vehicle in its own {mi}, shape (vehicle, N_STATE).
            geometry: where the {mi} frames are measured to be.
            reference: what to track.
            applied_thrusts: inputs of the interval before the horizon [N], shape (vehicle, N_INPUT).
            sqp_steps: take so many SQP steps, as a recorded flight did; None: as many as the limits allow.
        """
        begin = self._clock()
        first_solve = not self._started
        tolerance = self._config.kkt_tolerance_start if first_solve else self._config.kkt_tolerance
        steps_max = self._config.sqp_steps_start_max if first_solve else self._config.sqp_steps_max
        steps: list[SqpStep] = []
        failure = self._prepare_failure
        plan = guess
        while not failure:
            try:
                if steps:
                    self._rti.prepare(plan, geometry)
                steps.append(self._rti.feedback(initial_states, geometry, reference, applied_thrusts))
            except QpError as error:
                failure = str(error)
                break
            plan = steps[-1].plan
            if sqp_steps is not None:
                enough = len(steps) >= sqp_steps
            else:
                in_time = first_solve or self._clock() - begin < self._time_budget
                enough = steps[-1].kkt < tolerance or len(steps) >= steps_max or not in_time
            if enough:
                break
        self._started = self._started or not failure
        if failure:
            state = SolverState.FALLBACK
        else:
            state = SolverState.SOLVED if steps[-1].kkt < tolerance else SolverState.STEP_LIMIT
        return plan, SolverReport(
            state=state,
            fallback_reason=failure,
            objective=steps[-1].objective if steps else math.nan,
            kkt_first=steps[0].kkt if steps else math.nan,
            kkt=steps[-1].kkt if steps else math.nan,
            sqp_steps=len(steps),
            qp_iterations=sum(step.qp_iterations for step in steps),
            active_bounds=steps[-1].active_bounds if steps else 0,
            prepare_time=self._prepare_time,
            feedback_time=self._clock() - begin,
        )
