"""The structure `Team` that Python and the C code of the fast solver share: its arrays and their shapes."""

import ctypes
from collections.abc import Mapping

import numpy as np

from relform_controller.ocp import layout
from relform_controller.ocp.problem import Ocp
from relform_controller.solver.lanes import N_LANES
from relform_controller.solver.stages import stage_state_size
from relform_core.arrays import Array

_ALIGNMENT = 64
"""What loads of whole lanes need [bytes]."""
_LONGS = ("n", "N", "n_pairs", "n_rows", "n_constraints", "iterations", "corrected", "has_barrier", "soft")
_DOUBLES = ("memory", "decay", "thrust_min", "thrust_max", "kkt", "objective", "vehicle_cost")
_ARRAYS: Mapping[str, tuple[str, str, str]] = {
    # name: type, shape, meaning. ny: padded stage states of the team, nu: its inputs, rows: soft constraints.
    "pairs": ("long", "pairs 2", "observer, target"),
    "rows": ("long", "rows 3", "0 of a vehicle or 1 of a pair; which one; row of the function"),
    "states": ("double", "n N+1 12", "of the guess"),
    "commands": ("double", "n N 4", "of the guess"),
    "rotors": ("double", "n N+1 4", "of the guess"),
    "disturbances": ("double", "n 4", "acceleration, thrust scale"),
    "vehicle_weights": ("double", "vehicle_terms", ""),
    "leader_weights": ("double", "N leader_terms", ""),
    "pair_weights": ("double", "pairs N pair_terms", ""),
    "row_prices": ("double", "rows 2", "linear, square"),
    "vehicle_frames": ("double", "n 4", "p_NI_N, yaw_NI; predicted in `prepare`, measured in `feedback`"),
    "pair_frames": ("double", "pairs 4", "p_I1I2_I1, yaw_I1I2; likewise"),
    "leader_reference": ("double", "N+1 4", "p_NB_N, yaw_NB"),
    "pair_reference": ("double", "pairs N+1 3", "p_B1B2_C1"),
    "dz0": ("double", "n nz", "measured minus guessed start"),
    "free_response": ("double", "N+1 n nz", "deviations that follow from dz0 with du = 0"),
    "dz": ("double", "N+1 n nz", "what du adds to it"),
    "du": ("double", "N n 4", "result"),
    "slope": ("double", "N n 4", "derivative of the least cost by each command on a bound"),
    "side": ("signed char", "N n 4", "bound that each command is on: -1 lower, 1 upper, 0 none"),
    "vehicle_out": ("lanes", "vehicle", "outputs of the functions of a stage"),
    "leader_hessian_out": ("lanes", "leader_hessian", ""),
    "pair_hessian_out": ("lanes", "pair_hessian", ""),
    "vehicle_rows_out": ("lanes", "vehicle_rows", ""),
    "pair_rows_out": ("lanes", "pair_rows", ""),
    "core": ("double", "n N 12 16", "[A | B_f] of each vehicle"),
    "gap": ("double", "N n 12", ""),
    "q_vehicle": ("double", "N+1 ny", "gradient by z of the terms of vehicles at the guess"),
    "r_vehicle": ("double", "N nu", "by u"),
    "q": ("double", "N+1 ny", "gradient by z at the free response"),
    "r": ("double", "N nu", "by u"),
    "P": ("double", "N+1 blocks", "Hessian of the cost-to-go"),
    "p": ("double", "N+1 ny", "gradient of the cost-to-go"),
    "G_uu": ("double", "N nu nu", ""),
    "U": ("double", "N nu nu", "L'"),
    "Y": ("double", "N nu ny", "rows of fixed commands are those of G_uz"),
    "g_u": ("double", "N nu", "with what the commands on bounds add"),
    "y": ("double", "N nu", ""),
    "dz_at": ("double", "N+1 ny", "iterate of the interior-point method"),
    "du_at": ("double", "N nu", ""),
    "slack": ("double", "constraints", "upper bounds, lower bounds, h <= sigma, sigma >= 0"),
    "multiplier": ("double", "constraints", ""),
    "d_slack": ("double", "constraints", "steps"),
    "d_multiplier": ("double", "constraints", ""),
    "product": ("double", "constraints", "of the steps"),
    "bound_weight": ("double", "N nu", "what bounds add to the Hessian"),
    "row_weight": ("double", "N rows", "what soft constraints add to it"),
    "row_free": ("double", "N rows", "h of the free response"),
    "row_offset": ("double", "N rows", ""),
    "row_excess": ("double", "N rows", ""),
    "q_plain": ("double", "N+1 ny", "gradients without bounds and soft constraints"),
    "r_plain": ("double", "N nu", ""),
    "q_at": ("double", "N+1 ny", "these gradients at the iterate"),
    "r_at": ("double", "N nu", ""),
}
_KINDS = {"double": np.float64, "long": np.int64, "signed char": np.int8, "lanes": np.float64}


def c_structure() -> str:
    """``Team`` in C."""
    scalars = [*(f"  long {name};" for name in _LONGS), *(f"  double {name};" for name in _DOUBLES)]
    arrays = [
        f"  {kind} *{name}; /* [{shape}] {meaning} */" for name, (kind, shape, meaning) in _ARRAYS.items()
    ]
    return "\n".join(["typedef struct {", *scalars, *arrays, "} Team;\n"])


class Structure(ctypes.Structure):
    """``Team`` in Python."""

    _fields_ = (
        *((name, ctypes.c_long) for name in _LONGS),
        *((name, ctypes.c_double) for name in _DOUBLES),
        *((name, ctypes.c_void_p) for name in _ARRAYS),
    )


class KernelTeam:
    """The memory of one team: item access gives its arrays by name.

    Args:
        ocp: the problem.
        n_terms: numbers of terms of the cost: of vehicles, of the leader, of pairs.
        rows: soft constraints, as the array of this name has them.
        n_outputs: of each function of a stage, by name.
    """

    def __init__(
        self,
        ocp: Ocp,
        n_terms: tuple[int, int, int],
        rows: list[tuple[int, int, int]],
        n_outputs: Mapping[str, int],
    ) -> None:
        n, N, n_pairs, nu = ocp.n_vehicles, ocp.n_stages, len(ocp.pairs), layout.N_INPUT * ocp.n_vehicles
        nz = -(-stage_state_size(ocp) // N_LANES) * N_LANES
        n_constraints = 2 * N * nu + 2 * N * len(rows)
        n_items = {"vehicle": n * N, "leader": N, "pair": n_pairs * N}
        sizes = {
            **{
                "n": n,
                "N": N,
                "N+1": N + 1,
                "pairs": n_pairs,
                "rows": len(rows),
                "constraints": n_constraints,
            },
            **{"nz": nz, "ny": n * nz, "nu": nu},
            **dict(zip(("vehicle_terms", "leader_terms", "pair_terms"), n_terms, strict=True)),
            "blocks": n * (n + 1) // 2 * stage_state_size(ocp) * nz,
        }
        for name in ("vehicle", "leader_hessian", "pair_hessian", "vehicle_rows", "pair_rows"):
            groups = -(-n_items[name.partition("_")[0]] // N_LANES)
            sizes[name] = groups * n_outputs.get(name, 0) * N_LANES
        self._arrays = {
            name: _aligned(
                tuple(sizes[size] if size in sizes else int(size) for size in shape.split()), _KINDS[kind]
            )
            for name, (kind, shape, _) in _ARRAYS.items()
        }
        self.structure = Structure(
            n=n,
            N=N,
            n_pairs=n_pairs,
            n_rows=len(rows),
            n_constraints=n_constraints,
            thrust_min=ocp.thrust_min,
            thrust_max=ocp.thrust_max,
        )
        for name, array in self._arrays.items():
            setattr(self.structure, name, array.ctypes.data)
        self.pointer = ctypes.byref(self.structure)
        self["pairs"][...] = np.array(ocp.pairs).reshape(-1, 2)
        self["rows"][...] = np.array(rows).reshape(-1, 3)

    def __getitem__(self, name: str) -> Array:
        return self._arrays[name]


def _aligned(shape: tuple[int, ...], kind: type) -> Array:
    """Zeros at an address from which whole lanes can be loaded."""
    size = int(np.prod(shape)) * np.dtype(kind).itemsize
    memory = np.zeros(size + _ALIGNMENT, dtype=np.uint8)
    begin = -memory.ctypes.data % _ALIGNMENT
    array: Array = memory[begin : begin + size].view(kind).reshape(shape)
    return array
