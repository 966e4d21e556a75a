"""C code, compiled on first use into a library that is kept in the user's cache folder.

The name of the library is a hash of everything that it depends on, so that an old one is never used for new
code. A seal at its end, after what the loader reads, is a hash of the name's hash and of the content: a
library that is cut off, damaged or was made for another machine is not loaded, but compiled again.
"""

import atexit
import ctypes
import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
import warnings
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from relform_core.atomic_file import written_atomically
from relform_core.errors import RelformError


class NoCompilerError(RelformError):
    """There is no C compiler, or no folder for what it compiles: use what needs none."""


COMPILER_FLAGS = ("-O3", "-march=native", "-ffp-contract=fast", "-fno-math-errno", "-fPIC", "-shared")
FORMAT = "sealed"
"""Of the files in the cache."""
SEAL_BYTES = 32


def shared_library(source: str, flags: Sequence[str] = COMPILER_FLAGS) -> Path:
    """Path of a shared library made of C code, from the cache if it has been compiled before.

    Where the cache cannot be used, the library is kept until the process ends. There is one warning per
    process without a compiler, and one for each library that is damaged or cannot be kept.

    Raises:
        NoCompilerError: there is none, or no folder from which a library can be loaded.
        RelformError: the compiler fails.
    """
    compiler = shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc")
    if compiler is None:
        message = "no C compiler found: install one (apt install gcc) or name it in the variable CC"
        warnings.warn(f"{message}; flights are much slower without", RuntimeWarning, stacklevel=1)
        raise NoCompilerError(message)
    version = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=False).stdout
    depends_on = "\n".join([FORMAT, source, compiler, version, *flags, _cpu()])
    key = hashlib.sha256(depends_on.encode(), usedforsecurity=False).digest()
    library = cache_folder() / f"kernels-{key.hex()[:20]}.so"
    content = _read(library)
    if content is not None and _is_sealed(content, key):
        return _loadable(library, content)
    if content is not None:
        _warn(f"{library}: damaged, or made for another machine: it is compiled again")
    content = _sealed(_compiled(compiler, flags, source), key)
    try:
        library.parent.mkdir(parents=True, exist_ok=True)
        with written_atomically(library) as stream:  # several processes may compile at the same time
            stream.write(content)
    except OSError as error:
        _warn(f"{library}: cannot be written: {error.strerror}; set XDG_CACHE_HOME to another folder")
        return _temporary(library.name, content)
    return _loadable(library, content)


def cache_folder() -> Path:
    """Where libraries are kept."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "relform"


def _compiled(compiler: str, flags: Sequence[str], source: str) -> bytes:
    with tempfile.TemporaryDirectory(prefix="relform-") as folder:
        text, built = Path(folder) / "kernels.c", Path(folder) / "kernels.so"
        text.write_text(source)
        result = subprocess.run(
            [compiler, *flags, str(text), "-o", str(built), "-lm"],
            capture_output=True,
            text=True,
            check=False,
        )
        if result.returncode != 0:
            raise RelformError(
                f"{compiler} cannot compile the kernels: {' '.join(result.stderr.split())[:500]}"
            )
        return built.read_bytes()


def _read(library: Path) -> bytes | None:
    """Content of a library; None: there is none, or it may not be read."""
    try:
        return library.read_bytes()
    except OSError:
        return None


def _sealed(content: bytes, key: bytes) -> bytes:
    return content + hashlib.sha256(key + content, usedforsecurity=False).digest()


def _is_sealed(content: bytes, key: bytes) -> bool:
    return _sealed(content[:-SEAL_BYTES], key) == content


def _loadable(library: Path, content: bytes) -> Path:
    """The library, or a copy of it where the folder does not allow to load code from it."""
    try:
        ctypes.CDLL(str(library))
    except OSError as error:
        _warn(f"{error}; set XDG_CACHE_HOME to another folder")
        return _temporary(library.name, content)
    return library


def _temporary(name: str, content: bytes) -> Path:
    """A library that is kept until the process ends.

    Raises:
        NoCompilerError: it cannot be written or loaded there.
    """
    try:
        library = _temporary_folder() / name
        library.write_bytes(content)
        ctypes.CDLL(str(library))
    except OSError as error:
        raise NoCompilerError(f"compiled code cannot be kept or loaded anywhere: {error}") from None
    return library


@cache
def _temporary_folder() -> Path:
    folder = tempfile.mkdtemp(prefix="relform-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def _warn(message: str) -> None:
    warnings.warn(message, RuntimeWarning, stacklevel=1)


def _cpu() -> str:
    """What -march=native depends on."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return "\n".join(sorted({line for line in lines if line.startswith(("model name", "flags"))}))
