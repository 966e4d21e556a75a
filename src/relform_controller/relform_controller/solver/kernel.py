"""The fast solver: the SQP step of the reference, compiled from C (``kernel_code``)."""

import ctypes

import numpy as np

from relform_controller.ocp.problem import HorizonReference, HorizonStart, Ocp, Plan, TeamGeometry
from relform_controller.ocp.terms.term import Terms
from relform_controller.solver.kernel_code import kernel_code
from relform_controller.solver.kernel_team import KernelTeam
from relform_controller.solver.linearization import (
    disturbances,
    leader_frame,
    pair_frames,
    row_prices,
    rows_of_pairs,
    term_weights,
    vehicle_frames,
)
from relform_controller.solver.solver import QpError, SqpStep
from relform_controller.solver.stages import BEFORE, ROTORS, STATE
from relform_core.arrays import Mask
from relform_core.c_library import COMPILER_FLAGS, shared_library
from relform_core.controller_config import WeightsConfig

_FLAGS = (*COMPILER_FLAGS, "-Wno-psabi", "-funroll-loops")
"""Unrolled loops make a step about 5% faster."""
_NOT_FINITE, _NOT_CONVERGED = 1, 2
"""Results of `feedback` in C."""


class KernelSolver:
    """SQP steps in C (``Solver``).

    Args:
        ocp: the problem.
        terms: of its cost.
    Raises:
        NoCompilerError: there is none.
        RelformError: the compiler fails, or its result cannot be kept.
    """

    def __init__(self, ocp: Ocp, terms: Terms) -> None:
        self._ocp, self._terms = ocp, terms
        code = kernel_code(ocp, terms)
        self._library = ctypes.CDLL(str(shared_library(code.source, _FLAGS)))
        n_terms = len(terms.vehicle), len(terms.leader), len(terms.pair)
        own = range(len(ocp.constraints.vehicle))
        rows = [(0, vehicle, row) for vehicle in range(ocp.n_vehicles) for row in own]
        rows += [(1, pair, row) for pair, row in rows_of_pairs(ocp)]
        self._team = KernelTeam(ocp, n_terms, rows, code.n_outputs)
        self._team["row_prices"][...] = row_prices(ocp)
        self._guess: Plan | None = None
        self.set_weights(ocp.weights)

    def set_weights(self, weights: WeightsConfig) -> None:
        """See ``Solver``."""
        of_terms, team = term_weights(self._ocp, self._terms, weights), self._team
        team["vehicle_weights"][...] = of_terms.vehicle
        team["leader_weights"][...] = of_terms.leader
        team["pair_weights"][...] = of_terms.pair
        self._guess = None

    def prepare(self, guess: Plan, geometry: TeamGeometry) -> None:
        """See ``Solver``."""
        team, lag, ocp = self._team, guess.rotors.lag, self._ocp
        self._guess = None
        team["states"][...] = guess.states
        team["commands"][...] = guess.thrusts
        if ocp.rotors_may_lag:
            team["rotors"][...] = guess.rotor_thrusts(ocp.stage)
        team["disturbances"][...] = disturbances(ocp, geometry)
        self._place(geometry)
        team.structure.memory, team.structure.decay = lag.memory(ocp.stage), lag.decay(ocp.stage)
        if self._library.prepare(team.pointer):
            raise QpError("the Hessian is not finite or not positive definite")
        self._guess = guess

    def feedback(self, start: HorizonStart, geometry: TeamGeometry, reference: HorizonReference) -> SqpStep:
        """See ``Solver``."""
        guess, team, ocp = self._guess, self._team, self._ocp
        if guess is None:
            raise RuntimeError("feedback() needs a prepare() that succeeded before it")
        dz0 = team["dz0"]
        dz0[:, STATE] = start.states - guess.states[:, 0]
        dz0[:, BEFORE] = start.applied_thrusts - guess.thrusts[:, 0]
        if ocp.rotors_may_lag:
            dz0[:, ROTORS] = start.rotors.thrusts - guess.rotors.thrusts
        self._place(geometry)
        team["leader_reference"][:, :3] = reference.p_NB_N
        team["leader_reference"][:, 3] = reference.yaw_NB
        team["pair_reference"][...] = reference.p_B1B2_C1
        status = self._library.feedback(team.pointer)
        if status == _NOT_FINITE:
            raise QpError("the gradient is not finite")
        if status == _NOT_CONVERGED:
            raise QpError("the interior-point method did not converge")
        states = guess.states + (team["free_response"] + team["dz"])[..., STATE].swapaxes(0, 1)
        thrusts = guess.thrusts + team["du"].swapaxes(0, 1)
        np.clip(thrusts, ocp.thrust_min, ocp.thrust_max, out=thrusts)
        structure = team.structure
        return SqpStep(
            Plan(states, thrusts, start.rotors),
            structure.kkt,
            structure.objective,
            structure.iterations,
            active_bounds=int(np.count_nonzero(team["side"])),
            active_constraints=self._active_constraints() if structure.soft else (),
        )

    def _active_constraints(self) -> tuple[str, ...]:
        """Names of the constraints that are active at the solution of the interior-point method."""
        team, n_stages, constraints = self._team, self._ocp.n_stages, self._ocp.constraints
        first = 2 * team["du"].size  # after the bounds
        rows = slice(first, first + n_stages * len(constraints.names))
        active: Mask = team["multiplier"][rows] > team["slack"][rows]
        return constraints.active(active.reshape(n_stages, -1))

    def _place(self, geometry: TeamGeometry) -> None:
        """Where the {mi} frames lie."""
        frames = self._team["vehicle_frames"]
        if self._ocp.constraints.vehicle:
            frames[...] = vehicle_frames(self._ocp, geometry)
        else:  # nothing asks where the followers are in the world
            frames[0] = leader_frame(geometry)
        self._team["pair_frames"][...] = pair_frames(geometry)
