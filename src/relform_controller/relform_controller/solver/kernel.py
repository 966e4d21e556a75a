"""The fast solver: the SQP step of the reference, compiled from C (``kernel_source``)."""

import ctypes

import numpy as np

from relform_controller.c_library import COMPILER_FLAGS, shared_library
from relform_controller.ocp import layout
from relform_controller.ocp.problem import HorizonReference, HorizonStart, Ocp, Plan, TeamGeometry
from relform_controller.ocp.terms.term import Terms
from relform_controller.solver.kernel_source import kernel_source
from relform_controller.solver.lanes import N_LANES
from relform_controller.solver.linearization import disturbances
from relform_controller.solver.reference import ReferenceSolver
from relform_controller.solver.solver import QpError, SqpStep
from relform_controller.solver.stages import stage_state_size
from relform_core.arrays import Array
from relform_core.controller_config import WeightsConfig

_ALIGNMENT = 64
_NOT_FINITE, _UNSETTLED = 1, 2
"""Results of `feedback` in C."""
_NU, _NX = layout.N_INPUT, layout.N_STATE


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
        self._library = ctypes.CDLL(
            str(shared_library(kernel_source(ocp, terms), (*COMPILER_FLAGS, "-Wno-psabi")))
        )
        self._team = _Team(self._library, ocp)
        self._reference = ReferenceSolver(ocp, terms)
        self._prepared: tuple[Plan, TeamGeometry] | None = None
        self.set_weights(ocp.weights)

    def set_weights(self, weights: WeightsConfig) -> None:
        """See ``Solver``."""
        ocp, terms, team = self._ocp, self._terms, self._team
        last = np.ones(ocp.n_stages)
        last[-1] = weights.terminal_scale
        team["vehicle_weights"][...] = [term.weight(ocp, weights) for term in terms.vehicle]
        team["leader_weights"][...] = np.outer(last, [term.weight(ocp, weights) for term in terms.leader])
        for pair, (i, j) in enumerate(ocp.pairs):
            of_pair = [term.weight(ocp, weights, i, j) for term in terms.pair]
            team["pair_weights"][pair] = np.outer(last, of_pair)
        self._reference.set_weights(weights)
        self._prepared = None

    def prepare(self, guess: Plan, geometry: TeamGeometry) -> None:
        """See ``Solver``."""
        team, lag, ocp = self._team, guess.rotors.lag, self._ocp
        self._prepared = None
        team["states"][...] = guess.states
        team["commands"][...] = guess.thrusts
        if ocp.rotors_may_lag:
            rotors = guess.rotors
            for stage in range(ocp.n_stages + 1):
                team["rotors"][:, stage] = rotors.thrusts
                if stage < ocp.n_stages:
                    rotors = rotors.after(guess.thrusts[:, stage], ocp.stage)
        team["disturbances"][...] = disturbances(ocp, geometry)
        self._place(geometry)
        team.struct.memory, team.struct.decay = lag.memory(ocp.stage), lag.decay(ocp.stage)
        if self._library.prepare(team.pointer):
            raise QpError("the Hessian is not finite or not positive definite")
        self._prepared = guess, geometry

    def feedback(self, start: HorizonStart, geometry: TeamGeometry, reference: HorizonReference) -> SqpStep:
        """See ``Solver``."""
        if self._prepared is None:
            raise RuntimeError("feedback() needs a prepare() that succeeded before it")
        guess, team, ocp = self._prepared[0], self._team, self._ocp
        dz0 = team["dz0"]
        dz0[:, :_NX] = start.states - guess.states[:, 0]
        dz0[:, _NX : _NX + _NU] = start.applied_thrusts - guess.thrusts[:, 0]
        if ocp.rotors_may_lag:
            dz0[:, _NX + _NU : _NX + 2 * _NU] = start.rotors.thrusts - guess.rotors.thrusts
        self._place(geometry)
        team["leader_reference"][:, :3] = reference.p_NB_N
        team["leader_reference"][:, 3] = reference.yaw_NB
        team["pair_reference"][...] = reference.p_B1B2_C1
        status = self._library.feedback(team.pointer)
        if status == _NOT_FINITE:
            raise QpError("the gradient is not finite")
        if status == _UNSETTLED:
            self._reference.prepare(*self._prepared)
            return self._reference.feedback(start, geometry, reference)
        states = guess.states + team["dz"][..., :_NX].swapaxes(0, 1)
        thrusts = guess.thrusts + team["du"].swapaxes(0, 1)
        np.clip(thrusts, ocp.thrust_min, ocp.thrust_max, out=thrusts)
        struct = team.struct
        return SqpStep(
            Plan(states, thrusts, start.rotors),
            struct.kkt,
            struct.objective,
            struct.iterations,
            struct.active,
        )

    def _place(self, geometry: TeamGeometry) -> None:
        team = self._team
        team["leader_frame"][:3], team["leader_frame"][3] = geometry.p_NI_N, geometry.yaw_NI
        team["pair_frames"][:, :3], team["pair_frames"][:, 3] = geometry.p_I1I2_I1, geometry.yaw_I1I2


class _Team:
    """The C structure of a team, and the arrays that it points to."""

    def __init__(self, library: ctypes.CDLL, ocp: Ocp) -> None:
        n, N, n_pairs = ocp.n_vehicles, ocp.n_stages, len(ocp.pairs)
        sizes = (ctypes.c_long * 8).in_dll(library, "team_sizes")
        vehicle_out, leader_hessian_out, pair_hessian_out, vehicle_terms, leader_terms, pair_terms, nz, nf = (
            sizes
        )
        nzu = nz * n, _NU * n
        n_z, n_u = nzu
        block, blocks = stage_state_size(ocp) * nz, n * (n + 1) // 2

        def groups(items: int) -> int:
            return -(-items // N_LANES)

        self._shapes: dict[str, tuple[int, ...]] = {
            "states": (n, N + 1, _NX),
            "commands": (n, N, _NU),
            "rotors": (n, N + 1, _NU),
            "disturbances": (n, 4),
            "vehicle_weights": (vehicle_terms,),
            "leader_weights": (N, leader_terms),
            "pair_weights": (n_pairs, N, pair_terms),
            "pairs": (n_pairs, 2),
            "leader_frame": (4,),
            "pair_frames": (n_pairs, 4),
            "leader_reference": (N + 1, 4),
            "pair_reference": (n_pairs, N + 1, 3),
            "dz0": (n, nz),
            "dz": (N + 1, n, nz),
            "du": (N, n, _NU),
            "slope": (N, n, _NU),
            "side": (N, n, _NU),
            "vehicle_out": (groups(n * N), vehicle_out, N_LANES),
            "leader_hessian_out": (groups(N), leader_hessian_out, N_LANES),
            "pair_hessian_out": (groups(n_pairs * N), pair_hessian_out, N_LANES),
            "core": (n, N, _NX, nf),
            "gap": (N, n, _NX),
            "q_vehicle": (N + 1, n_z),
            "q": (N + 1, n_z),
            "r": (N, n_u),
            "P": (N + 1, blocks, block),
            "P_gap": (N, n_z),
            "p": (N + 1, n_z),
            "G_uz": (N, n_u, n_z),
            "G_uu": (N, n_u, n_u),
            "U": (N, n_u, n_u),
            "Y": (N, n_u, n_z),
            "g_u": (N, n_u),
            "y": (N, n_u),
        }
        kinds = {"pairs": np.int64, "side": np.int8}
        self._arrays = {
            name: _aligned(shape, kinds.get(name, np.float64)) for name, shape in self._shapes.items()
        }
        scalars_before = {"n": n, "N": N, "n_pairs": n_pairs}
        names = list(self._shapes)
        results = names.index("side") + 1

        class Struct(ctypes.Structure):
            _fields_ = [
                *((name, ctypes.c_long) for name in scalars_before),
                *((name, ctypes.c_double) for name in ("memory", "decay", "thrust_min", "thrust_max")),
                *((name, ctypes.c_void_p) for name in names[:results]),
                *((name, ctypes.c_double) for name in ("kkt", "objective")),
                *((name, ctypes.c_long) for name in ("iterations", "active")),
                *((name, ctypes.c_void_p) for name in names[results:]),
                ("vehicle_cost", ctypes.c_double),
                ("corrected", ctypes.c_long),
            ]

        self.struct = Struct(**scalars_before, thrust_min=ocp.thrust_min, thrust_max=ocp.thrust_max)
        for name, array in self._arrays.items():
            setattr(self.struct, name, array.ctypes.data)
        self.pointer = ctypes.byref(self.struct)
        self["pairs"][...] = np.array(ocp.pairs).reshape(-1, 2)

    def __getitem__(self, name: str) -> Array:
        return self._arrays[name]


def _aligned(shape: tuple[int, ...], kind: type) -> Array:
    """Zeros at an address that lanes can be loaded from."""
    size = int(np.prod(shape)) * np.dtype(kind).itemsize
    memory = np.zeros(size + _ALIGNMENT, dtype=np.uint8)
    begin = -memory.ctypes.data % _ALIGNMENT
    array: Array = memory[begin : begin + size].view(kind).reshape(shape)
    return array
