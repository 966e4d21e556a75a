"""acados, installed from a wheel into a folder of its own, beside the environment of relform.

No dependency of relform: the benchmark compares with it where it can be installed. The folder is apart
because the wheel brings its own CasADi.
"""

import ctypes
import importlib
import os
import subprocess
import sys
import warnings
from pathlib import Path
from types import ModuleType

PACKAGE = "comma-deps-acados==0.2.2.post92"
AGE = "acados of mid 2023 with BLASFEO for Haswell, from the wheel " + PACKAGE.replace("==", " ")
_LIBRARIES = ("libblasfeo.so", "libhpipm.so", "libqpOASES_e.so", "libacados.so")


class PeerUnavailableError(Exception):
    """acados cannot be used here; the text gives the reason on one line."""


def peer_folder() -> Path:
    """Where acados and what it generates are kept."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "relform-bench"


def install() -> Path:
    """The folder of acados, which is installed first if it is missing.

    Raises:
        PeerUnavailableError: the wheel cannot be fetched, for instance offline.
    """
    folder = peer_folder() / PACKAGE.replace("==", "-")
    if not (folder / "acados").is_dir():
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"]
        result = subprocess.run(
            [*pip, "--target", str(folder), PACKAGE], capture_output=True, text=True, check=False
        )
        if result.returncode != 0:
            lines = result.stderr.strip().splitlines() or ["no reason given"]
            raise PeerUnavailableError(f"{PACKAGE} cannot be installed: {lines[-1]}")
    return folder


def load() -> ModuleType:
    """The Python interface of acados, with its libraries loaded.

    Raises:
        PeerUnavailableError: it cannot be installed or loaded.
    """
    folder = install()
    root = folder / "acados/install"
    os.environ["ACADOS_SOURCE_DIR"] = str(root)
    os.environ["ACADOS_PYTHON_INTERFACE_PATH"] = str(folder / "acados/acados_template")
    os.environ["TERA_PATH"] = str(root / "bin/t_renderer")
    try:
        # Loaded here, they are found again by the solver that is linked to them.
        for library in _LIBRARIES:
            ctypes.CDLL(str(root / "lib" / library), mode=ctypes.RTLD_GLOBAL)
        sys.path.append(str(folder))  # last: CasADi is that of relform
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return importlib.import_module("acados.acados_template")
    except (OSError, ImportError) as error:
        raise PeerUnavailableError(f"{PACKAGE} cannot be loaded: {error}") from None
