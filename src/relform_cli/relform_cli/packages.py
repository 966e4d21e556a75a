"""Installed packages and their executables."""

import os
from argparse import Namespace
from pathlib import Path

from ament_index_python import PackageNotFoundError, get_package_prefix, get_packages_with_prefixes

from relform_cli.errors import CommandError


def package_names() -> list[str]:
    return sorted(get_packages_with_prefixes())


def package_prefix(package: str) -> Path:
    """The folder that a package is installed in.

    Raises:
        CommandError: the package is not installed.
    """
    try:
        return Path(get_package_prefix(package))
    except (PackageNotFoundError, ValueError):  # for names that are not valid
        raise CommandError(f"Package '{package}' not found") from None


def executables(package: str) -> list[Path]:
    """The executables of a package: all below its lib folder.

    Raises:
        CommandError: no such package.
    """
    found = []
    for folder, subfolders, names in os.walk(package_prefix(package) / "lib" / package):
        subfolders[:] = [name for name in subfolders if not name.startswith(".")]
        paths = (Path(folder, name) for name in names)
        found += [path for path in paths if os.access(path, os.X_OK)]
    return sorted(found)


def complete_package(**_: object) -> list[str]:
    return package_names()


def complete_executable(parsed_args: Namespace, **_: object) -> list[str]:
    try:
        return [path.name for path in executables(parsed_args.package_name)]
    except CommandError:
        return []
