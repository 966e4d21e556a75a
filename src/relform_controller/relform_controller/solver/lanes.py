"""CasADi functions as C code that evaluates eight items at once, one per lane of a vector.

The code that CasADi writes itself works on single numbers, and compilers do not vectorise a loop around it.
"""

from dataclasses import dataclass

import casadi as ca

N_LANES = 8

_OPERATIONS = {
    ca.OP_ADD: "{0} + {1}",
    ca.OP_SUB: "{0} - {1}",
    ca.OP_MUL: "{0} * {1}",
    ca.OP_DIV: "{0} / {1}",
    ca.OP_FMAX: "lanes_max({0}, {1})",
    ca.OP_FMIN: "-lanes_max(-({0}), -({1}))",
    ca.OP_LE: "lanes_le({0}, {1})",
    ca.OP_FABS: "lanes_max({0}, -({0}))",
    ca.OP_SIGN: "lanes_le(0.0 * {0}, {0}) - lanes_le({0}, 0.0 * {0})",
    ca.OP_NEG: "-({0})",
    ca.OP_SQ: "({0})*({0})",
    ca.OP_TWICE: "({0})+({0})",
    ca.OP_INV: "1.0/({0})",
    ca.OP_SQRT: "lanes_sqrt({0})",
    ca.OP_SIN: "lanes_sin({0})",
    ca.OP_COS: "lanes_cos({0})",
    ca.OP_TAN: "lanes_sin({0}) / lanes_cos({0})",
    ca.OP_ASSIGN: "{0}",
}


@dataclass(frozen=True)
class LaneFunction:
    """C code of a function, and which numbers it reads and writes."""

    name: str
    n_arguments: int
    code: str
    """``static void <name>(const lanes *in, lanes *out)``."""
    inputs: tuple[tuple[int, int], ...]
    """(argument, element) of each value of ``in``; arguments are dense."""
    outputs: tuple[tuple[int, int, int], ...]
    """(output, row, column) of each value of ``out``; other elements are zero."""


def lane_function(function: ca.Function) -> LaneFunction:
    """The code of a CasADi function of SX symbols.

    Raises:
        ValueError: it has an operation that is not known here.
    """
    places = [list(zip(*_triplets(function.sparsity_out(i)), strict=True)) for i in range(function.n_out())]
    inputs: dict[tuple[int, int], int] = {}
    outputs: list[tuple[int, int, int]] = []
    values: dict[int, float] = {}
    """Work variables that are constants at this point of the code."""
    lines: list[str] = []
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        read, written = function.instruction_input(k), function.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            output, place = written[0], places[written[0]][written[1]]
            value = f"all_lanes({values[read[0]]!r})" if read[0] in values else f"w{read[0]}"
            lines.append(f"out[{len(outputs)}] = {value};")
            outputs.append((output, *place))
            continue
        target = written[0]
        if operation == ca.OP_CONST:
            values[target] = function.instruction_constant(k)
            continue
        arguments = [f"all_lanes({values[i]!r})" if i in values else f"w{i}" for i in read]
        values.pop(target, None)
        if operation == ca.OP_INPUT:
            lines.append(f"w{target} = in[{inputs.setdefault((read[0], read[1]), len(inputs))}];")
        elif operation in _OPERATIONS:
            lines.append(f"w{target} = {_OPERATIONS[operation].format(*arguments)};")
        else:
            raise ValueError(f"{function.name()}: operation {operation} has no code for lanes")
    work = ", ".join(f"w{i}" for i in range(function.sz_w()))
    body = "\n  ".join(lines)
    code = f"static void {function.name()}(const lanes *in, lanes *out) {{\n  lanes {work};\n  {body}\n}}\n"
    return LaneFunction(function.name(), function.n_in(), code, tuple(inputs), tuple(outputs))


def _triplets(sparsity: ca.Sparsity) -> tuple[list[int], list[int]]:
    rows, columns = sparsity.get_triplet()
    return rows, columns
