"""The solver that a flight uses."""

from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.terms.registry import TERMS
from relform_controller.ocp.terms.term import Terms
from relform_controller.solver.kernel import KernelSolver
from relform_controller.solver.reference import ReferenceSolver
from relform_controller.solver.solver import Solver
from relform_core.c_library import NoCompilerError


def make_solver(ocp: Ocp, terms: Terms = TERMS) -> Solver:
    """The fast solver, or the reference where there is no C compiler.

    Raises:
        RelformError: the compiler fails, or its result cannot be kept.
    """
    try:
        return KernelSolver(ocp, terms)
    except NoCompilerError:
        return ReferenceSolver(ocp, terms)
