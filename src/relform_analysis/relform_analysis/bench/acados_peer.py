"""The problem of the team, solved by acados: the same terms, model, bounds and stages.

Its settings are the fastest of those tried: costs as expressions with a Gauss-Newton Hessian of our own,
discrete dynamics, and HPIPM with a low start of its barrier (docs/performance.md).
"""

import contextlib
import os
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from relform_analysis.bench.acados_package import PeerUnavailableError, load
from relform_analysis.bench.streams import Instance
from relform_analysis.bench.team_problem import TeamProblem
from relform_controller.ocp import layout
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.terms.term import Terms
from relform_core.arrays import Array

_NO_BOUND = 1e3
"""Far beyond every excess [m, rad, m/s]."""


@dataclass(frozen=True)
class Settings:
    """What acados is told about the way to solve."""

    qp_solver: str = "PARTIAL_CONDENSING_HPIPM"
    cond_stages: int = 5
    """Stages of the QP after partial condensing."""
    hpipm_mode: str = "SPEED"
    mu0: float = 1e-4
    warm_start: int = 1
    compile_flags: str = "-O2 -march=native"


@dataclass(frozen=True)
class PeerStep:
    """The outcome of one SQP step of acados."""

    first_inputs: Array
    """[N], shape (vehicle, N_INPUT)."""
    prepare: float
    feedback: float
    """Time by its own timer [s]."""
    status: int


class AcadosPeer:
    """SQP steps by acados.

    Args:
        ocp: the problem, without lag of the rotors.
        terms: of its cost.
        settings: how to solve it.
    Raises:
        PeerUnavailableError: acados cannot be installed, or its code not be compiled.
    """

    def __init__(self, ocp: Ocp, terms: Terms, settings: Settings | None = None) -> None:
        if ocp.rotors_may_lag:
            raise PeerUnavailableError("the problem for acados has no rotor lag")
        self._ocp, self._settings = ocp, settings or Settings()
        self._team = TeamProblem(ocp, terms)
        acados = load()
        # A new folder each time: acados would load the code of another problem under the same name.
        self._folder = tempfile.TemporaryDirectory(prefix="relform-acados-")
        begin = time.perf_counter()
        self._solver = self._built(acados, Path(self._folder.name))
        self.build_time = time.perf_counter() - begin
        """Time to generate and compile its code [s]."""

    def step(self, instance: Instance) -> PeerStep:
        """One SQP step at the guess of an instance, with the measured geometry throughout."""
        solver = self._solver
        states, inputs = self._team.guess(instance)
        for stage, (z, p) in enumerate(zip(states, self._team.parameters(instance), strict=True)):
            solver.set(stage, "x", z)
            solver.set(stage, "p", p)
        for stage, u in enumerate(inputs):
            solver.set(stage, "u", u)
        solver.options_set("rti_phase", 1)
        solver.solve()
        prepare = _timer(solver)
        start = self._team.start(instance)
        solver.set(0, "lbx", start)
        solver.set(0, "ubx", start)
        solver.options_set("rti_phase", 2)
        status = int(solver.solve())
        first_inputs = np.array(solver.get(0, "u")).reshape(-1, layout.N_INPUT)
        return PeerStep(first_inputs, prepare, _timer(solver), status)

    def _built(self, acados: Any, folder: Path) -> Any:
        problem = self._problem(acados)
        problem.code_export_directory = str(folder / "code")
        with _in_folder(folder), contextlib.redirect_stdout(None):
            try:
                solver = acados.AcadosOcpSolver(problem, json_file=str(folder / "ocp.json"), verbose=False)
            except Exception as error:  # acados raises plain exceptions for all that can go wrong
                raise PeerUnavailableError(f"acados cannot build its solver: {error}") from error
        if "HPIPM" in self._settings.qp_solver:
            solver.options_set("qp_mu0", self._settings.mu0)
        if n_rows := len(self._team.prices):
            # Stage 0 is measured: nothing can be done about what it violates.
            solver.constraints_set(0, "uh", np.full(n_rows, _NO_BOUND))
        return solver

    def _problem(self, acados: Any) -> Any:
        ocp, team, settings = self._ocp, self._team, self._settings
        problem = acados.AcadosOcp()
        model = problem.model
        model.name = "team"
        model.x, model.u, model.p = team.z, team.u, team.p
        model.disc_dyn_expr = ca.cse(team.following)
        # This version multiplies the cost of a stage by its length, except the last one.
        both = ca.vertcat(team.u, team.z)
        for suffix, residual, by, scale in (
            ("_0", team.first_residual, both, 1.0 / ocp.stage),
            ("", team.residual, both, 1.0 / ocp.stage),
            ("_e", team.last_residual, team.z, 1.0),
        ):
            jacobian = ca.jacobian(residual, by)
            hessian = ca.cse(2.0 * scale * (jacobian.T @ jacobian))
            setattr(model, f"cost_expr_ext_cost{suffix}", scale * ca.sumsqr(residual))
            setattr(model, f"cost_expr_ext_cost_custom_hess{suffix}", hessian)
            setattr(problem.cost, f"cost_type{suffix}", "EXTERNAL")
        problem.dims.N = ocp.n_stages
        problem.parameter_values = np.zeros(team.p.numel())
        constraints, n_inputs = problem.constraints, team.u.numel()
        constraints.lbu = np.full(n_inputs, ocp.thrust_min)
        constraints.ubu = np.full(n_inputs, ocp.thrust_max)
        constraints.idxbu = np.arange(n_inputs)
        constraints.x0 = np.zeros(team.z.numel())
        self._add_soft_constraints(problem)
        options = problem.solver_options
        options.tf = ocp.n_stages * ocp.stage
        options.integrator_type = "DISCRETE"
        options.nlp_solver_type = "SQP_RTI"
        options.hessian_approx = "GAUSS_NEWTON"
        options.qp_solver = settings.qp_solver
        if settings.qp_solver == "PARTIAL_CONDENSING_HPIPM":
            options.qp_solver_cond_N = settings.cond_stages
        options.hpipm_mode = settings.hpipm_mode
        options.qp_solver_warm_start = settings.warm_start
        options.ext_fun_compile_flags = settings.compile_flags
        options.print_level = 0
        return problem

    def _add_soft_constraints(self, problem: Any) -> None:
        """Excess <= 0 of every stage, each with a slack."""
        team, (model, constraints, cost) = self._team, (problem.model, problem.constraints, problem.cost)
        if not (n_rows := len(team.prices)):
            return
        for suffix, scale in (("", 1.0 / self._ocp.stage), ("_e", 1.0)):
            setattr(model, f"con_h_expr{suffix}", ca.cse(team.excess))
            setattr(constraints, f"lh{suffix}", np.full(n_rows, -_NO_BOUND))
            setattr(constraints, f"uh{suffix}", np.zeros(n_rows))
            setattr(constraints, f"idxsh{suffix}", np.arange(n_rows))
            for side in "lu":
                setattr(cost, f"z{side}{suffix}", scale * team.prices[:, 0])
                setattr(cost, f"Z{side}{suffix}", scale * team.prices[:, 1])


def _timer(solver: Any) -> float:
    """Time of the last call, by its own timer [s]."""
    return float(np.asarray(solver.get_stats("time_tot")).item())


@contextlib.contextmanager
def _in_folder(folder: os.PathLike[str]) -> Iterator[None]:
    """acados writes some files into the working directory."""
    before = os.getcwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)
