"""No source file runs what it reads: no pickle, no unsafe YAML, no shell, no server beyond this machine."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

WORKSPACE = Path(__file__).parents[2]
SOURCES = sorted(
    path.relative_to(WORKSPACE)
    for folder in ("src", "scripts", "examples")
    for path in (WORKSPACE / folder).rglob("*.py")
)
UNSAFE_MODULES = {"pickle", "cPickle", "marshal", "shelve", "dill", "cloudpickle", "joblib"}
"""Reading data with them runs code in the data."""
PYYAML_LOADS = {"load", "load_all", "unsafe_load", "unsafe_load_all", "full_load", "full_load_all"}
EVALUATES = {"src/relform_cli/relform_cli/topic_echo.py": "ros2 topic echo --filter, the user's own"}
"""Files that call eval, with the reason."""
BINDS_EVERYWHERE = {
    "src/relform_core/relform_core/ros_domain.py": "finds out whether another program has a port of DDS",
    "src/relform_cli/relform_cli/participants.py": "likewise",
}
"""Files that bind a socket on all addresses for a moment and never listen, with the reason."""


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse((WORKSPACE / path).read_text())


def calls(path: Path) -> Iterator[tuple[str, ast.Call]]:
    """All calls in a file, by the last part of the name of what is called."""
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            yield name, node


def given(call: ast.Call, name: str) -> object:
    """The constant value of a keyword argument; None: it is not given, or is no constant."""
    values = [each.value for each in call.keywords if each.arg == name]
    return values[0].value if values and isinstance(values[0], ast.Constant) else None


def test_data_is_not_run() -> None:
    assert [problem for path in SOURCES for problem in problems_of(path)] == []


def problems_of(path: Path) -> Iterator[str]:
    has_pyyaml = False
    for node in ast.walk(tree_of(path)):
        modules = [each.name for each in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom) and node.module is not None:
            modules.append(node.module)
        for module in modules:
            has_pyyaml |= module == "yaml"
            if module.partition(".")[0] in UNSAFE_MODULES:
                yield f"{path} imports {module}"
    for name, call in calls(path):
        owner = call_of_attribute(call)
        is_unsafe = {
            "runs text": name in ("eval", "exec") and not owner and str(path) not in EVALUATES,
            "reads YAML with any tag": name == "YAML" and given(call, "typ") != "safe",
            "reads YAML with any tag by PyYAML": has_pyyaml and owner == "yaml" and name in PYYAML_LOADS,
            "runs a shell": given(call, "shell") is True or (owner == "os" and name in ("system", "popen")),
            "unpickles": owner == "np" and name == "load" and given(call, "allow_pickle") is not False,
        }
        yield from (f"{path}:{call.lineno} {problem}" for problem, holds in is_unsafe.items() if holds)


def test_nothing_listens_beyond_this_machine() -> None:
    for path in SOURCES:
        assert "0.0.0.0" not in (WORKSPACE / path).read_text(), path
        for name, call in calls(path):
            if name != "bind" or not call.args or not isinstance(call.args[0], ast.Tuple):
                continue
            host = call.args[0].elts[0]
            is_local = isinstance(host, ast.Name) and host.id == "HOST"
            assert is_local or str(path) in BINDS_EVERYWHERE, f"{path}:{call.lineno}"


def call_of_attribute(call: ast.Call) -> str:
    """The name of the object whose method is called; empty: it is no method of a plain name."""
    owner = call.func.value if isinstance(call.func, ast.Attribute) else None
    return owner.id if isinstance(owner, ast.Name) else ""


def test_the_view_is_served_on_this_machine() -> None:
    from relform_live.viewer.server import HOST

    assert HOST in ("127.0.0.1", "localhost")
