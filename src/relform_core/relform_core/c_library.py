"""C code, compiled on first use into a library that is kept in the user's cache folder.

The name of the library is a hash of everything that it depends on, so that an old one is never used for new
code.
"""

import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
import warnings
from collections.abc import Sequence
from pathlib import Path

from relform_core.atomic_file import written_atomically
from relform_core.errors import RelformError


class NoCompilerError(RelformError):
    """There is no C compiler: use what needs none."""


COMPILER_FLAGS = ("-O3", "-march=native", "-ffp-contract=fast", "-fno-math-errno", "-fPIC", "-shared")


def shared_library(source: str, flags: Sequence[str] = COMPILER_FLAGS) -> Path:
    """Path of a shared library made of C code, from the cache if it has been compiled before.

    Without a compiler there is one warning per process, however often this is called.

    Raises:
        NoCompilerError: there is none.
        RelformError: the compiler fails, or the cache cannot be written.
    """
    compiler = shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc")
    if compiler is None:
        message = "no C compiler found: install one (apt install gcc) or name it in the variable CC"
        warnings.warn(f"{message}; flights are much slower without", RuntimeWarning, stacklevel=1)
        raise NoCompilerError(message)
    version = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=False).stdout
    depends_on = "\n".join([source, compiler, version, *flags, _cpu()])
    key = hashlib.sha256(depends_on.encode(), usedforsecurity=False)
    library = _cache_folder() / f"kernels-{key.hexdigest()[:20]}.so"
    if not os.path.exists(library):  # unlike Path.exists, no error where the folder is forbidden
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
