"""config/nodes.yaml: a flight started by hand with it is the flight of the scenario that it names."""

from collections.abc import Iterator, Mapping
from typing import Any

import pytest

from relform_core.load import load_scenario
from relform_core.yaml_files import read_mapping
from support.scenarios import CONFIG_FOLDER

SECTIONS = read_mapping(CONFIG_FOLDER / "nodes.yaml")
SCENARIO = load_scenario(CONFIG_FOLDER.parent / SECTIONS["/**"]["ros__parameters"]["scenario"])


def values(tree: Mapping[str, Any], path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    for key, value in tree.items():
        if isinstance(value, Mapping):
            yield from values(value, (*path, key))
        else:
            yield (*path, key), value


@pytest.mark.parametrize(
    ("section", "of_scenario"), [("/formation/controller", "controller"), ("/*/quadrotor", "vehicle")]
)
def test_live_values_of_the_file_are_those_of_its_scenario(section: str, of_scenario: str) -> None:
    found = list(values(SECTIONS[section]["ros__parameters"]))
    assert found
    for path, value in found:
        written: Any = SCENARIO.written[of_scenario]
        for key in path:
            written = written[key]
        assert value == written, ".".join(path)
