"""CasADi functions, compiled by the machine's C compiler and evaluated for many items at once.

CasADi writes the C code, the C compiler makes a library of it, and the library is kept in the user's cache
folder under a hash of everything that it depends on.
"""

import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from relform_core.arrays import Array
from relform_core.atomic_file import written_atomically
from relform_core.errors import RelformError

COMPILER_FLAGS = ("-O3", "-march=native", "-ffp-contract=fast", "-fno-math-errno", "-fPIC", "-shared")


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

    def __call__(self, *inputs: Array) -> tuple[Array, ...]:
        """Evaluate all items; each input has shape (..., size), with the items in the leading axes."""
        for buffer, array in zip(self._inputs, inputs, strict=True):
            buffer[...] = array.reshape(buffer.shape)
        self._evaluate()
        return self._outputs


def compiled(functions: Sequence[tuple[ca.Function, int]]) -> Mapping[str, Kernel]:
    """The functions as kernels, by name; each comes with its number of items.

    Raises:
        RelformError: there is no C compiler, or it fails.
    """
    library = _compile([_mapped(function, n_items) for function, n_items in functions])
    return {f.name(): Kernel(ca.external(f.name(), str(library)), n_items) for f, n_items in functions}


def _mapped(function: ca.Function, n_items: int) -> ca.Function:
    # Wrapped, because the map itself cannot be given the plain name under which the library exports it.
    mapped = function.map(n_items)
    arguments = [ca.MX.sym(f"i{i}", *mapped.size_in(i)) for i in range(mapped.n_in())]
    return ca.Function(function.name(), arguments, mapped.call(arguments))


def _item_array(size: tuple[int, int], n_items: int) -> Array:
    rows, columns = size[0], size[1] // n_items
    return np.zeros((n_items, rows) if columns == 1 else (n_items, columns, rows))


def _compile(functions: Sequence[ca.Function]) -> Path:
    """Path of a shared library that exports the functions, from the cache if it has been compiled before."""
    compiler = shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc")
    if compiler is None:
        raise RelformError("no C compiler found: install one (apt install gcc) or name it in the variable CC")
    with tempfile.TemporaryDirectory(prefix="relform-") as folder:
        generator = ca.CodeGenerator("kernels.c")
        for function in functions:
            generator.add(function)
        source = Path(generator.generate(f"{folder}/"))
        version = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=False).stdout
        key = hashlib.sha256(
            "\n".join([source.read_text(), version, *COMPILER_FLAGS, _cpu()]).encode(), usedforsecurity=False
        ).hexdigest()
        library = _cache_folder() / f"kernels-{key[:20]}.so"
        if not os.path.exists(library):  # unlike Path.exists, no error where the folder is forbidden
            built = Path(folder) / "kernels.so"
            result = subprocess.run(
                [compiler, *COMPILER_FLAGS, str(source), "-o", str(built), "-lm"],
                capture_output=True,
                text=True,
                check=False,
            )
            if result.returncode != 0:
                raise RelformError(
                    f"{compiler} cannot compile the kernels: {' '.join(result.stderr.split())[:500]}"
                )
            _publish(built, library)
    return library


def _publish(built: Path, library: Path) -> None:
    """Copy a finished file into the cache atomically: several processes may compile at the same time."""
    try:
        library.parent.mkdir(parents=True, exist_ok=True)
        with written_atomically(library) as stream:
            stream.write(built.read_bytes())
    except OSError as error:
        raise RelformError(
            f"{library}: cannot be written: {error.strerror}; set XDG_CACHE_HOME to another folder"
        ) from None


def _cache_folder() -> Path:
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "relform"


def _cpu() -> str:
    """What -march=native depends on."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return "\n".join(sorted({line for line in lines if line.startswith(("model name", "flags"))}))
