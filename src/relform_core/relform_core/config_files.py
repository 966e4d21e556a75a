"""Find configuration files, by path or by the plain name of one that is installed with relform_bringup."""

import os
import re
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

from relform_core.errors import ConfigError
from relform_core.suggestions import did_you_mean

PACKAGE = "relform_bringup"
"""Package that installs the folder ``config/``."""
FOLDERS = {
    "scenario": "scenarios",
    "vehicle": "vehicles",
    "sensors": "sensors",
    "controller": "controller",
    "variants": "sweeps",
}
"""Folder in ``config/`` of each kind of file."""
SUFFIX = ".yaml"
_PLAIN_NAME = re.compile(r"[\w-]+")


def is_plain_name(reference: str) -> bool:
    """Whether a reference is a plain name, such as ``paper``; ``./paper`` and ``paper.yaml`` are paths."""
    return _PLAIN_NAME.fullmatch(reference) is not None


def find_config(kind: str, reference: str | Path, folder: Path | None = None) -> Path:
    """The file that a reference names.

    Args:
        kind: a key of ``FOLDERS``.
        reference: a path, or a plain name.
        folder: paths are relative to it; None: to the working directory.
    Raises:
        ConfigError: one line: no file of this name is installed.
    """
    if isinstance(reference, str) and is_plain_name(reference):
        known = installed_configs(kind)
        if reference not in known:
            expected = f" or one of {', '.join(known)}" if known else f"; {PACKAGE} is not installed"
            meant = did_you_mean(reference, known)
            raise ConfigError(
                f"unknown {kind} '{reference}'{meant}: expected a file name ({SUFFIX}){expected}"
            )
        return known[reference]
    return Path(os.path.normpath(folder / reference)) if folder is not None else Path(reference)


def installed_configs(kind: str) -> dict[str, Path]:
    """The installed files of a kind by their plain names, in alphabetical order."""
    try:
        config = Path(get_package_share_directory(PACKAGE), "config")
    except PackageNotFoundError:
        return {}
    return {path.stem: path for path in sorted((config / FOLDERS[kind]).glob(f"*{SUFFIX}"))}
