"""Whatever is wrong in a scenario or in a file that it names, the answer is one line for each problem.

The long form: ``RELFORM_EXAMPLES=3000 pytest tests/property/core/test_spoilt_scenarios.py``.
"""

import copy
import os
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relform_core.errors import ConfigError
from relform_core.load import load_scenario
from relform_core.yaml_files import read_mapping, to_text
from support.scenarios import CONFIG_FOLDER
from support.spoilt_files import with_another_value, with_other_bytes

EXAMPLES = int(os.environ.get("RELFORM_EXAMPLES", "40"))
SCENARIOS = sorted((CONFIG_FOLDER / "scenarios").glob("*.yaml"))
LINE_MAX = 6000
"""A name of 5000 characters is repeated once."""
SEEDS = st.integers(0, 2**32)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of all scenarios: vehicles, sensors, controllers, paths."""
    folder = tmp_path_factory.mktemp("config")
    for path in CONFIG_FOLDER.rglob("*"):
        if path.is_file():
            copied = folder / path.relative_to(CONFIG_FOLDER)
            copied.parent.mkdir(parents=True, exist_ok=True)
            copied.write_bytes(path.read_bytes())
    return folder


def assert_loaded_or_explained(path: Path) -> None:
    try:
        loaded = load_scenario(path)
    except ConfigError as error:
        lines = str(error).split("\n")
        assert all(line.strip() and line.isprintable() and len(line) <= LINE_MAX for line in lines), lines
        return
    again = path.with_name("again.yaml")
    again.write_text(loaded.effective_yaml)
    assert load_scenario(again).fingerprint == loaded.fingerprint


@given(SEEDS)
@settings(max_examples=EXAMPLES)
def test_other_values(folder: Path, seed: int) -> None:
    random = Random(seed)
    tree = copy.deepcopy(read_mapping(random.choice(SCENARIOS)))
    for _ in range(random.choice((1, 1, 2, 3))):
        with_another_value(tree, random)
    path = folder / "scenarios/spoilt.yaml"
    path.write_text(to_text(tree))
    assert_loaded_or_explained(path)


@given(SEEDS)
@settings(max_examples=EXAMPLES)
def test_other_bytes(folder: Path, seed: int) -> None:
    """In the scenario itself, or in a file that it names."""
    random = Random(seed)
    scenario = random.choice(SCENARIOS)
    named = [path for path in folder.rglob("*") if path.suffix in (".yaml", ".csv") and path.is_file()]
    spoilt = folder / "scenarios/spoilt.yaml"
    spoilt.write_bytes(scenario.read_bytes())
    file = random.choice([spoilt, *(path for path in named if path.parent.name != "scenarios")])
    content = file.read_bytes()
    try:
        file.write_bytes(with_other_bytes(content, random))
        assert_loaded_or_explained(spoilt)
    finally:
        file.write_bytes(content)
