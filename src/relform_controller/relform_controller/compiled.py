"""CasADi functions, compiled by the machine's C compiler and evaluated for many items at once."""

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from relform_core.arrays import Array
from relform_core.c_library import NoCompilerError, shared_library

CompiledFunction = Callable[..., tuple[Array, ...]]
"""A CasADi function that evaluates all its items; its outputs are valid until the next call."""


class Kernel:
    """A CasADi function, mapped over items, that is called on NumPy arrays without conversions.

    Every call returns the same output arrays: use or copy them before the next call.
    """

    def __init__(self, function: ca.Function, n_items: int) -> None:
        self._buffer: Any  # its type hints are those of the C++ method
        self._buffer, self._evaluate = function.buffer()
        self._inputs = [_item_array(function.size_in(i), n_items) for i in range(function.n_in())]
        outputs = [_item_array(function.size_out(i), n_items) for i in range(function.n_out())]
        for i, array in enumerate(self._inputs):
            self._buffer.set_arg(i, array.data)
        for i, array in enumerate(outputs):
            self._buffer.set_res(i, array.data)
        # CasADi stores matrices by column, so each item comes out transposed.
        self._outputs = tuple(array.swapaxes(1, 2) if array.ndim == 3 else array for array in outputs)

    @classmethod
    def interpreted(cls, function: ca.Function, n_items: int) -> "Kernel":
        """A function evaluated without a compiler; its outputs are dense."""
        arguments = [ca.SX.sym(f"i{i}", *function.size_in(i)) for i in range(function.n_in())]
        outputs = [ca.densify(output) for output in function.call(arguments)]
        dense = ca.Function(function.name(), arguments, outputs)
        return cls(_mapped(dense, n_items), n_items)

    def __call__(self, *inputs: Array) -> tuple[Array, ...]:
        """Evaluate all items; each input has shape (..., size), with the items in the leading axes."""
        for buffer, array in zip(self._inputs, inputs, strict=True):
            buffer[...] = array.reshape(buffer.shape)
        self._evaluate()
        return self._outputs


def compiled(function: ca.Function, n_items: int) -> Kernel:
    """The function as a kernel. Without a C compiler CasADi interprets it.

    Raises:
        RelformError: the compiler fails, or its result cannot be kept.
    """
    try:
        library = shared_library(generated_c([_mapped(function, n_items)]))
    except NoCompilerError:
        return Kernel.interpreted(function, n_items)
    return Kernel(ca.external(function.name(), str(library)), n_items)


def generated_c(functions: Sequence[ca.Function]) -> str:
    """C code of CasADi functions, each under its own name."""
    generator = ca.CodeGenerator("generated.c")
    for function in functions:
        generator.add(function)
    text: str = generator.dump()
    return text


def _mapped(function: ca.Function, n_items: int) -> ca.Function:
    # Wrapped, because the map itself cannot be given the plain name under which the library exports it.
    mapped = function.map(n_items)
    arguments = [ca.MX.sym(f"i{i}", *mapped.size_in(i)) for i in range(mapped.n_in())]
    return ca.Function(function.name(), arguments, mapped.call(arguments))


def _item_array(size: tuple[int, int], n_items: int) -> Array:
    rows, columns = size[0], size[1] // n_items
    return np.zeros((n_items, rows) if columns == 1 else (n_items, columns, rows))
