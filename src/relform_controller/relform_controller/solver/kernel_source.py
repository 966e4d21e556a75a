"""The C code of the fast solver: functions of a stage on lanes, tables of their outputs, the recursion."""

from collections.abc import Iterable
from pathlib import Path

from relform_controller.ocp import layout
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.terms.term import Terms
from relform_controller.solver.lanes import N_LANES, LaneFunction, lane_function
from relform_controller.solver.stages import stage_functions

_FOLDER = Path(__file__).parent


def kernel_source(ocp: Ocp, terms: Terms) -> str:
    """For any number of vehicles and stages."""
    functions = stage_functions(ocp, terms)
    vehicle = lane_function(functions.vehicle)
    leader_hessian = lane_function(functions.leader_hessian)
    leader_gradient = lane_function(functions.leader_gradient)
    pair_hessian = lane_function(functions.pair_hessian)
    pair_gradient = lane_function(functions.pair_gradient)
    following, by_state, by_mean_thrusts, cost, gradient, hessian = (_Output(vehicle, i) for i in range(6))
    n_core = layout.N_STATE + layout.N_INPUT
    core_to = [row * n_core + column for row, column in by_state.places]
    core_to += [row * n_core + layout.N_STATE + column for row, column in by_mean_thrusts.places]
    return "".join(
        [
            (_FOLDER / "lanes.c").read_text(),
            f"#define N_ROTOR {layout.N_INPUT if ocp.rotors_may_lag else 0}\n",
            *map(_function, (vehicle, leader_hessian, leader_gradient, pair_hessian, pair_gradient)),
            _table("vehicle_following", following.numbers),
            _table("vehicle_core_from", by_state.numbers + by_mean_thrusts.numbers),
            _table("vehicle_core_to", core_to),
            f"enum {{ VEHICLE_CORE = {len(core_to)}, vehicle_cost_from = {cost.numbers[0]} }};\n",
            _gradient_tables("vehicle", gradient),
            _hessian_tables("vehicle", hessian),
            _gradient_tables("leader", _Output(leader_gradient, 1)),
            _hessian_tables("leader", _Output(leader_hessian, 0)),
            _gradient_tables("pair", _Output(pair_gradient, 1)),
            _hessian_tables("pair", _Output(pair_hessian, 0)),
            f"enum {{ leader_cost_from = {_Output(leader_gradient, 0).numbers[0]} }};\n",
            f"enum {{ pair_cost_from = {_Output(pair_gradient, 0).numbers[0]} }};\n",
            f"enum {{ VEHICLE_TERMS = {len(terms.vehicle)} }};\n",
            f"enum {{ LEADER_TERMS = {len(terms.leader)}, PAIR_TERMS = {len(terms.pair)} }};\n",
            (_FOLDER / "riccati.c").read_text(),
        ]
    )


class _Output:
    """One output of a function: the numbers of its values, and their rows and columns."""

    def __init__(self, function: LaneFunction, output: int) -> None:
        of_output = [(q, row, column) for q, (i, row, column) in enumerate(function.outputs) if i == output]
        self.numbers = [q for q, _, _ in of_output]
        self.places = [(row, column) for _, row, column in of_output]


def _function(function: LaneFunction) -> str:
    name = function.name
    parameters = ", ".join(f"const double *a{i}" for i in range(function.n_arguments))
    reads = "\n  ".join(f"in[{q * N_LANES}] = a{i}[{e}];" for q, (i, e) in enumerate(function.inputs))
    sizes = f"{name.upper()}_IN = {len(function.inputs)}, {name.upper()}_OUT = {len(function.outputs)}"
    gather = f"static inline void {name}_gather(double *in, {parameters}) {{\n  {reads}\n}}\n"
    return f"enum {{ {sizes} }};\n{function.code}{gather}"


def _gradient_tables(name: str, gradient: _Output) -> str:
    to = [row for row, _ in gradient.places]
    size = f"enum {{ {name.upper()}_GRADIENT = {len(to)} }};\n"
    return size + _table(f"{name}_gradient_from", gradient.numbers) + _table(f"{name}_gradient_to", to)


def _hessian_tables(name: str, hessian: _Output) -> str:
    return (
        f"enum {{ {name.upper()}_HESSIAN = {len(hessian.places)} }};\n"
        + _table(f"{name}_hessian_from", hessian.numbers)
        + _table(f"{name}_hessian_row", (row for row, _ in hessian.places))
        + _table(f"{name}_hessian_column", (column for _, column in hessian.places))
    )


def _table(name: str, values: Iterable[int]) -> str:
    return f"static const short {name}[] = {{{', '.join(map(str, values))}}};\n"
