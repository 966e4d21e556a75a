"""docs/library.md: its code is that of the examples, and its public names are there, typed and kept."""

import ast
import importlib
import inspect
import re
import typing
from pathlib import Path
from typing import Any

import pytest

from support.pages_with_commands import sections

WORKSPACE = Path(__file__).parents[2]
PAGE = WORKSPACE / "docs/library.md"
KEPT = WORKSPACE / "tests/data/public_names.txt"
EXAMPLES = sorted((WORKSPACE / "examples").glob("*.py"))
BLOCKS = [block for section in sections(PAGE) for block in section if block.language == "python"]
PUBLIC = [
    (module, name)
    for module, names in re.findall(r"^\| `(relform_[\w.]+)` \| (.*) \|$", PAGE.read_text(), re.MULTILINE)
    for name in re.findall(r"`(\w+)`", names)
]
ids = ".".join


def public(module: str, name: str) -> Any:
    return getattr(importlib.import_module(module), name)


def parameters(thing: Any) -> list[inspect.Parameter]:
    """Of a function, or of the constructor of a class; constants, protocols and errors have none."""
    is_class = inspect.isclass(thing) and not getattr(thing, "_is_protocol", False)
    if inspect.isfunction(thing) or (is_class and not issubclass(thing, Exception)):
        return list(inspect.signature(thing).parameters.values())
    return []


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.note)
def test_page_shows_the_code_of_an_example(block: Any) -> None:
    assert block.text in (WORKSPACE / block.note).read_text()


def test_fifteen_lines_are_shown_whole() -> None:
    (block,) = [block for block in BLOCKS if block.note.endswith("fifteen_lines.py")]
    text = (WORKSPACE / block.note).read_text()
    assert block.text == text
    assert len([line for line in text.splitlines() if line and not line.startswith(("#", '"""'))]) <= 15


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_examples_need_only_public_names(example: Path) -> None:
    imported = {
        (node.module, alias.name)
        for node in ast.walk(ast.parse(example.read_text()))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("relform_")
        for alias in node.names
    }
    modules = {tuple(module.rpartition(".")[::2]) for module, _ in PUBLIC}
    assert {each for each in imported if each[0] != "relform_msgs.msg"} <= {*PUBLIC, *modules}


@pytest.mark.parametrize(("module", "name"), PUBLIC, ids=map(ids, PUBLIC))
def test_public_name_is_typed_and_documented(module: str, name: str) -> None:
    thing = public(module, name)
    if not inspect.isclass(thing) and not inspect.isfunction(thing):
        return  # a constant
    assert thing.__module__ == module
    assert inspect.getdoc(thing)
    assert all(each.annotation is not inspect.Parameter.empty for each in parameters(thing))
    if inspect.isfunction(thing):
        assert "return" in typing.get_type_hints(thing)


@pytest.mark.parametrize(("module", "name"), PUBLIC, ids=map(ids, PUBLIC))
def test_strings_are_accepted_where_paths_are(module: str, name: str) -> None:
    thing = public(module, name)
    if not parameters(thing):
        return
    made = thing.__init__ if inspect.isclass(thing) and not hasattr(thing, "__dataclass_fields__") else thing
    for parameter, hint in typing.get_type_hints(made).items():
        taken = [hint, *typing.get_args(hint)]
        assert parameter == "return" or Path not in taken or str in taken


def test_public_names_are_kept() -> None:
    """They may get further parameters with defaults. A change of the file needs a line in CHANGELOG.md."""
    kept = {
        name: text.rstrip(")")
        for name, _, text in (row.partition("(") for row in KEPT.read_text().split("\n"))
    }
    assert [name for name in kept if name] == list(map(ids, PUBLIC))
    for module, name in PUBLIC:
        names = [each for each in kept[ids((module, name))].split(", ") if each]
        found = parameters(public(module, name))
        assert [each.name for each in found[: len(names)]] == names
        assert all(each.default is not each.empty for each in found[len(names) :])
