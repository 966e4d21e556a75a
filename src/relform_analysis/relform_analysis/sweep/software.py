"""Which software the result of a flight depends on, derived from what its modules import."""

import ast
import hashlib
import sys
from collections.abc import Iterator
from functools import cache
from importlib.metadata import packages_distributions, version
from importlib.util import find_spec
from pathlib import Path
from threading import Lock

ROOTS = ("relform_analysis.sweep.flight_row", "relform_analysis.flight.archive")
"""The modules that produce what a sweep keeps: the row of a flight, and its log."""
OURS = "relform_"
"""All packages of this workspace start with this."""


_ONE_AT_A_TIME = Lock()
"""Python 3.11 cannot build syntax trees in two threads at the same time, as a Dask worker would."""


def flight_software() -> str:
    """A hash of the code that flies and scores, and of the libraries under it."""
    with _ONE_AT_A_TIME:
        return _flight_software()


@cache
def _flight_software() -> str:
    modules, libraries = imported(ROOTS)
    digest = hashlib.sha256(usedforsecurity=False)
    for name in sorted(libraries):
        digest.update(f"{name} {libraries[name]}\n".encode())
    for name in sorted(modules):
        digest.update(f"{name}\n".encode())
        digest.update(modules[name].read_bytes())
    for source in sorted({source for file in modules.values() for source in file.parent.glob("*.c")}):
        digest.update(source.read_bytes())
    return digest.hexdigest()


def imported(roots: tuple[str, ...]) -> tuple[dict[str, Path], dict[str, str]]:
    """What some modules import, directly or not, wherever in them the import is written.

    Args:
        roots: names of modules of this workspace.
    Returns:
        Source files of the modules of this workspace by name, the roots included, and versions of the other
        libraries by name, without the standard library.
    """
    modules: dict[str, Path] = {}
    libraries: set[str] = set()
    waiting = list(roots)
    while waiting:
        name = waiting.pop()
        if not name.startswith(OURS):
            libraries.add(name.partition(".")[0])
        elif name not in modules and (file := _source(name)) is not None:
            modules[name] = file
            waiting += _imports(name, file)
            waiting += [name.rpartition(".")[0]] if "." in name else []  # a package runs its __init__ first
    return modules, dict(_versions(libraries - sys.stdlib_module_names))


def _imports(module: str, file: Path) -> Iterator[str]:
    """Names that a module imports; of ``from a import b`` both ``a`` and ``a.b``."""
    for node in ast.walk(ast.parse(file.read_bytes())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
            if any(alias.name == "import_module" for alias in node.names):
                # It imports by names that are known when it runs: any module beside it may be one.
                package = module.rpartition(".")[0]
                yield from (f"{package}.{other.stem}" for other in file.parent.glob("*.py"))


def _source(name: str) -> Path | None:
    """The source file of a module of this workspace; None if the name is not a module, but a name in one."""
    package, *parts = name.split(".")
    spec = find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        raise ModuleNotFoundError(f"no source of {package}", name=package)
    path = Path(spec.submodule_search_locations[0], *parts)
    return next((file for file in (path / "__init__.py", path.with_suffix(".py")) if file.is_file()), None)


def _versions(libraries: set[str]) -> Iterator[tuple[str, str]]:
    distributions = packages_distributions()
    for library in libraries:
        for distribution in distributions.get(library, ()):
            yield distribution, version(distribution)
