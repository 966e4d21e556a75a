"""The C code of the fast solver: functions of a stage on lanes, tables of their outputs, the algorithm."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from relform_controller.ocp import layout
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.terms.term import Terms
from relform_controller.solver.kernel_team import c_structure
from relform_controller.solver.lanes import N_LANES, LaneFunction, lane_function
from relform_controller.solver.stages import stage_functions

_FILES = (
    "team.c",
    "linearization.c",
    "constraints.c",
    "riccati.c",
    "active_set.c",
    "interior_point.c",
    "step.c",
)

_ROW_TABLES = """typedef struct {
  long n_out;
  const short *value, *begin, *from, *column;
} RowTables;
"""


@dataclass(frozen=True)
class KernelCode:
    """C code for any number of vehicles and stages."""

    source: str
    n_outputs: Mapping[str, int]
    """Number of outputs of each function of a stage, by name."""


def kernel_code(ocp: Ocp, terms: Terms) -> KernelCode:
    """The code for the model, the terms of the cost and the constraints of a problem."""
    functions = stage_functions(ocp, terms)
    vehicle = lane_function(functions.vehicle)
    leader_hessian = lane_function(functions.leader_hessian)
    leader_gradient = lane_function(functions.leader_gradient)
    pair_hessian = lane_function(functions.pair_hessian)
    pair_gradient = lane_function(functions.pair_gradient)
    rows = {
        name: None if function is None else lane_function(function)
        for name, function in (("vehicle", functions.vehicle_rows), ("pair", functions.pair_rows))
    }
    of_rows = [function for function in rows.values() if function is not None]
    all_functions = (vehicle, leader_hessian, leader_gradient, pair_hessian, pair_gradient, *of_rows)
    n_rows = {"vehicle": len(ocp.constraints.vehicle), "pair": len(ocp.constraints.pair)}
    source = "".join(
        [
            _read("lanes.c"),
            f"#define N_ROTOR {layout.N_INPUT if ocp.rotors_may_lag else 0}\n",
            *(f"#define {name.upper()}_ROWS {n}\n" for name, n in n_rows.items()),
            f"enum {{ LEADER_TERMS = {len(terms.leader)}, PAIR_TERMS = {len(terms.pair)} }};\n",
            *map(_function, all_functions),
            _vehicle_tables(vehicle),
            _cost_tables("leader", _Output(leader_gradient, 0), _Output(leader_gradient, 1), leader_hessian),
            _cost_tables("pair", _Output(pair_gradient, 0), _Output(pair_gradient, 1), pair_hessian),
            _ROW_TABLES,
            *(_row_tables(name, function) for name, function in rows.items()),
            c_structure(),
            *map(_read, _FILES),
        ]
    )
    return KernelCode(source, {function.name: len(function.outputs) for function in all_functions})


def _read(name: str) -> str:
    return (Path(__file__).parent / name).read_text()


class _Output:
    """One output of a function: the numbers of its values, and their rows and columns."""

    def __init__(self, function: LaneFunction, output: int) -> None:
        of_output = [(q, row, column) for q, (i, row, column) in enumerate(function.outputs) if i == output]
        self.numbers = [q for q, _, _ in of_output]
        self.places = [(row, column) for _, row, column in of_output]


def _function(function: LaneFunction) -> str:
    """The function, the numbers of its inputs and outputs, and how to gather the inputs of one lane."""
    name = function.name
    parameters = ", ".join(f"const double *a{i}" for i in range(function.n_arguments))
    reads = "\n  ".join(f"in[{q * N_LANES}] = a{i}[{e}];" for q, (i, e) in enumerate(function.inputs))
    sizes = f"{name.upper()}_IN = {len(function.inputs)}, {name.upper()}_OUT = {len(function.outputs)}"
    gather = f"static inline void {name}_gather(double *in, {parameters}) {{\n  {reads}\n}}\n"
    return f"enum {{ {sizes} }};\n{function.code}{gather}"


def _vehicle_tables(vehicle: LaneFunction) -> str:
    following, by_state, by_mean_thrusts, cost, gradient = (_Output(vehicle, i) for i in range(5))
    n_core = layout.N_STATE + layout.N_INPUT
    core_to = [row * n_core + column for row, column in by_state.places]
    core_to += [row * n_core + layout.N_STATE + column for row, column in by_mean_thrusts.places]
    return (
        _table("vehicle_following", following.numbers)
        + _table("vehicle_core_from", by_state.numbers + by_mean_thrusts.numbers)
        + _table("vehicle_core_to", core_to)
        + f"enum {{ VEHICLE_CORE = {len(core_to)} }};\n"
        # Position and velocity move little else: rows of their columns of [A | B_f] from here on are zero.
        + "enum {{ CORE_END_0 = {}, CORE_END_1 = {} }};\n".format(*_ends(by_state))
        + _cost_tables("vehicle", cost, gradient, vehicle, hessian_output=5)
    )


def _ends(by_state: _Output) -> tuple[int, int]:
    """One plus the last row that is not zero in the first four columns of the core; in the first eight."""
    first = max(row for row, column in by_state.places if column < 4)
    second = max(row for row, column in by_state.places if column < 8)
    return first + 1, second + 1


def _cost_tables(
    name: str, cost: _Output, gradient: _Output, hessian_of: LaneFunction, hessian_output: int = 0
) -> str:
    hessian = _Output(hessian_of, hessian_output)
    sizes = (
        f"{name.upper()}_GRADIENT = {len(gradient.numbers)}, {name.upper()}_HESSIAN = {len(hessian.numbers)}"
    )
    return (
        f"enum {{ {sizes}, {name}_cost_from = {cost.numbers[0]} }};\n"
        + _table(f"{name}_gradient_from", gradient.numbers)
        + _table(f"{name}_gradient_to", (row for row, _ in gradient.places))
        + _table(f"{name}_hessian_from", hessian.numbers)
        + _table(f"{name}_hessian_row", (row for row, _ in hessian.places))
        + _table(f"{name}_hessian_column", (column for _, column in hessian.places))
    )


def _row_tables(name: str, function: LaneFunction | None) -> str:
    """The value of each soft constraint, and its slopes, one constraint after the other."""
    if function is None:
        return f"static const RowTables {name}_row_tables = {{0}};\n"
    value, slopes = _Output(function, 0), _Output(function, 1)
    by_row: list[list[tuple[int, int]]] = [[] for _ in value.numbers]
    for number, (row, column) in zip(slopes.numbers, slopes.places, strict=True):
        by_row[row].append((number, column))
    in_order = [slope for row in by_row for slope in row]
    tables = {
        "value": value.numbers,
        "begin": [sum(map(len, by_row[:row])) for row in range(len(by_row) + 1)],
        "from": [number for number, _ in in_order],
        "column": [column for _, column in in_order],
    }
    members = ", ".join(f"{name}_rows_{member}" for member in tables)
    return (
        "".join(_table(f"{name}_rows_{member}", values) for member, values in tables.items())
        + f"static const RowTables {name}_row_tables = {{{len(function.outputs)}, {members}}};\n"
    )


def _table(name: str, values: Iterable[int]) -> str:
    return f"static const short {name}[] = {{{', '.join(map(str, values))}}};\n"
