"""The fast solver with a timer around its C code."""

import ctypes
import time
from typing import Any, cast

from relform_controller.ocp.problem import HorizonReference, HorizonStart, Ocp, Plan, TeamGeometry
from relform_controller.ocp.terms.registry import TERMS
from relform_controller.solver.kernel import KernelSolver
from relform_controller.solver.solver import SqpStep


class _TimedLibrary:
    """The functions of a solver in C, with the time of their last calls."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self._library = library
        self.times = {"prepare": 0.0, "feedback": 0.0}

    def prepare(self, team: Any) -> int:
        return self._call("prepare", team)

    def feedback(self, team: Any) -> int:
        return self._call("feedback", team)

    def _call(self, name: str, team: Any) -> int:
        function = getattr(self._library, name)
        begin = time.perf_counter()
        status: int = function(team)
        self.times[name] = time.perf_counter() - begin
        return status


class TimedKernelSolver(KernelSolver):
    """SQP steps in C, and the times of all of them.

    Args:
        ocp: the problem.
    Raises:
        NoCompilerError: there is no C compiler.
    """

    def __init__(self, ocp: Ocp) -> None:
        super().__init__(ocp, TERMS)
        self._timed = _TimedLibrary(self._library)
        self._library = cast(ctypes.CDLL, self._timed)
        self.prepare_times: list[float] = []
        self.feedback_times: list[float] = []
        """Inside the C code [s]."""
        self.whole_times: list[float] = []
        """Of every `prepare` and `feedback`, with the Python around the C code [s]."""

    def prepare(self, guess: Plan, geometry: TeamGeometry) -> None:
        """See ``Solver``."""
        begin = time.perf_counter()
        super().prepare(guess, geometry)
        self.whole_times.append(time.perf_counter() - begin)
        self.prepare_times.append(self._timed.times["prepare"])

    def feedback(self, start: HorizonStart, geometry: TeamGeometry, reference: HorizonReference) -> SqpStep:
        """See ``Solver``."""
        begin = time.perf_counter()
        step = super().feedback(start, geometry, reference)
        self.whole_times.append(time.perf_counter() - begin)
        self.feedback_times.append(self._timed.times["feedback"])
        return step
