"""Which software the result of a flight depends on."""

import hashlib
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("relform_core", "relform_sensors", "relform_sim", "relform_controller")
MODULES = (
    "relform_analysis.flight.simulate",
    "relform_analysis.flight.log",
    "relform_analysis.flight.metrics",
    "relform_analysis.sweep.statistics",
    "relform_analysis.flight.summary",
    "relform_analysis.flight.view_margins",
)
LIBRARIES = ("casadi", "daqp", "numpy", "scipy")


@cache
def flight_software() -> str:
    """A hash of the code that flies and scores, and of the libraries under it."""
    digest = hashlib.sha256(usedforsecurity=False)
    for library in LIBRARIES:
        digest.update(f"{library} {version(library)}\n".encode())
    for package in PACKAGES:
        for source in sorted(Path(_location(package)).parent.rglob("*.py")):
            if not source.name.endswith("_node.py"):
                digest.update(source.read_bytes())
    for module in MODULES:
        digest.update(Path(_location(module)).read_bytes())
    return digest.hexdigest()


def _location(name: str) -> str:
    spec = find_spec(name)
    if spec is None or spec.origin is None:
        raise ModuleNotFoundError(f"no source of {name}", name=name)
    return spec.origin
