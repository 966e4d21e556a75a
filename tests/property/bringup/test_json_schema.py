"""The JSON Schemas refuse the types, bounds and keys that the loader refuses, and no others."""

import copy
from collections.abc import Iterator
from typing import Any

from hypothesis import assume, given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from pydantic import ValidationError
from pydantic_core import to_json

from relform_bringup.configuration.file_kinds import FILE_KINDS
from relform_core.load import SECTIONS_IN_FILES, load_scenario
from relform_core.yaml_files import parse_value, read_mapping
from support.scenarios import CONFIG_FOLDER

SCENARIOS = ("paper", "field", "view", "pillar", "waypoints", "eight_ring")
LOADED = [kind for kind in FILE_KINDS if kind.name not in ("scenario", "nodes")]
TREES = [
    *((FILE_KINDS[0], parse_value(load_scenario(name).effective_yaml)) for name in SCENARIOS),
    *((kind, read_mapping(path)) for kind in LOADED for path in kind.files(CONFIG_FOLDER)),
]
VALIDATORS = {kind.name: Draft202012Validator(kind.json_schema) for kind in FILE_KINDS}
DELETED = object()
NUMBERS = st.floats(-1e7, 1e7).filter(lambda value: not value.is_integer())  # JSON takes 15.0 for an integer
VALUES = st.one_of(
    NUMBERS,
    st.integers(-2000, 2000),
    st.text("abc_XY ./=", max_size=70),
    st.sampled_from(["leader", "real_time", "team", "link", "circle", True, False, None, DELETED]),
    st.lists(NUMBERS, max_size=4),
    st.dictionaries(st.sampled_from(["kind", "surprise", "leader"]), st.sampled_from(["v", 1.5]), max_size=2),
)


def places(tree: Any, path: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """The path of every value below the top, and of a key that no section has."""
    items = list(tree.items()) if isinstance(tree, dict) else list(enumerate(tree))
    for key, value in items:
        yield (*path, key)
        if isinstance(value, dict | list):
            yield from places(value, (*path, key))
    if isinstance(tree, dict):
        yield (*path, "surprise")


PLACES = [(index, path) for index, (_, tree) in enumerate(TREES) for path in places(tree)]


def refusals(schema: Any, tree: Any) -> set[str]:
    """Types of the errors of loading."""
    try:
        schema.model_validate_json(to_json(tree))
    except ValidationError as error:
        return {each["type"] for each in error.errors()}
    return set()


@settings(max_examples=300, deadline=None)
@given(st.sampled_from(PLACES), VALUES)
def test_json_schema_and_loader_refuse_the_same(place: tuple[int, tuple[str | int, ...]], value: Any) -> None:
    index, path = place
    assume(not (isinstance(value, str) and path[0] in SECTIONS_IN_FILES and len(path) == 1))  # a file
    kind, tree = TREES[index]
    changed = copy.deepcopy(tree)
    node: Any = changed
    for key in path[:-1]:
        node = node[key]
    if value is not DELETED:
        node[path[-1]] = value
    elif path[-1] != "surprise":
        del node[path[-1]]
    refused = refusals(kind.schema, changed)
    accepted = VALIDATORS[kind.name].is_valid(changed)
    if not refused:
        assert accepted
    elif refused != {"value_error"}:  # those are relations between values, beyond a JSON Schema
        assert not accepted
