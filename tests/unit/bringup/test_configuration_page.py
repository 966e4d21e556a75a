"""docs/configuration.md and the JSON Schemas: up to date, complete, and true for every shipped file."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from pydantic_core import to_json

from relform_bringup.configuration.command import generated
from relform_bringup.configuration.examples import example_of, yaml_line
from relform_bringup.configuration.file_kinds import FILE_KINDS, SCHEMA_FOLDER, FileKind
from relform_core.config_files import installed_configs
from relform_core.errors import ConfigError
from relform_core.json_schema import JsonSchema, resolved
from relform_core.load import load_scenario, load_scenario_text
from relform_core.schema import Schema
from relform_core.units import unit_of
from relform_core.yaml_files import parse_value, read_mapping, to_text
from support.scenarios import CONFIG_FOLDER

WORKSPACE = CONFIG_FOLDER.parent
KINDS = {kind.name: kind for kind in FILE_KINDS}
SHIPPED = [(kind, path) for kind in FILE_KINDS for path in kind.files(CONFIG_FOLDER)]
PAGE = (WORKSPACE / "docs/configuration.md").read_text()
WITHOUT_UNIT = {
    "bias", "kkt_tolerance", "kkt_tolerance_start", "probability", "dropout_probability", "loss_probability",
    "scale", "solver_share", "terminal_scale", "wait_share",
}  # fmt: skip


def validator(kind: FileKind) -> Draft202012Validator:
    return Draft202012Validator(kind.json_schema)


def problems(kind: FileKind, tree: Any) -> list[str]:
    return [error.message for error in validator(kind).iter_errors(tree)]


def sections(kind: FileKind) -> Iterator[JsonSchema]:
    root = kind.json_schema
    yield from (node for node in (root, *root["$defs"].values()) if "properties" in node)


def keys(kind: FileKind) -> Iterator[tuple[str, JsonSchema]]:
    for section in sections(kind):
        yield from section["properties"].items()


@pytest.mark.parametrize("path", generated(WORKSPACE), ids=lambda path: path.name)
def test_generated_files_are_up_to_date(path: Path) -> None:
    assert path.read_text() == generated(WORKSPACE)[path], "run .venv/bin/python scripts/configuration.py"


def test_folder_of_schemas_has_no_others() -> None:
    assert {path.stem for path in (CONFIG_FOLDER / SCHEMA_FOLDER).iterdir()} == set(KINDS)


def test_links_within_the_page_lead_to_headings() -> None:
    headings = re.findall(r"^#+ (.*)$", PAGE, re.MULTILINE)
    anchors = {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}
    assert set(re.findall(r"\]\(#([^)]*)\)", PAGE)) <= anchors


@pytest.mark.parametrize("kind", FILE_KINDS, ids=lambda kind: kind.name)
def test_every_key_is_documented(kind: FileKind) -> None:
    root = kind.json_schema
    for key, value in keys(kind):
        meaning = value.get("description") or resolved(root, value).get("description", "")
        assert meaning.endswith(".") or key == "kind", key
    missing = [key for key, _ in keys(kind) if f"{key}:" not in PAGE]
    assert missing == []


@pytest.mark.parametrize("kind", FILE_KINDS, ids=lambda kind: kind.name)
def test_every_number_has_a_unit_in_its_key(kind: FileKind) -> None:
    root = kind.json_schema
    numbers = {key for key, value in keys(kind) if resolved(root, value).get("type") == "number"}
    assert {key for key in numbers if unit_of(key) is None} <= WITHOUT_UNIT


@pytest.mark.parametrize("kind", FILE_KINDS, ids=lambda kind: kind.name)
def test_schema_is_a_json_schema(kind: FileKind) -> None:
    Draft202012Validator.check_schema(kind.json_schema)


@pytest.mark.parametrize(("kind", "path"), SHIPPED, ids=lambda each: getattr(each, "stem", None))
def test_shipped_file_names_its_schema_and_fulfils_it(kind: FileKind, path: Path) -> None:
    first, _, _ = path.read_text().partition("\n")
    assert first == kind.schema_line
    named = (path.parent / first.partition("$schema=")[2]).resolve()
    assert named == CONFIG_FOLDER / SCHEMA_FOLDER / f"{kind.name}.json"
    assert problems(kind, read_mapping(path)) == []


@pytest.mark.parametrize("name", ["paper", "field", "twelve", "pillar", "tower"])
def test_effective_configuration_fulfils_the_schema(name: str) -> None:
    written = parse_value(load_scenario(name, ["pacing=real_time"]).effective_yaml)
    assert problems(KINDS["scenario"], written) == []


def classes(base: type[Schema] = Schema) -> Iterator[type[Schema]]:
    for each in base.__subclasses__():
        yield each
        yield from classes(each)


@pytest.mark.parametrize("kind", FILE_KINDS, ids=lambda kind: kind.name)
def test_examples_can_be_loaded_and_fulfil_the_schema(kind: FileKind) -> None:
    """Those beside the fields, put together to sections."""
    root, by_name = kind.json_schema, {each.__name__: each for each in classes()}
    for name, node in root["$defs"].items():
        if "properties" not in node:
            continue
        example = parse_value(yaml_line(example_of(root, node)))
        schema = {"$defs": root["$defs"], "$ref": f"#/$defs/{name}"}
        assert list(Draft202012Validator(schema).iter_errors(example)) == []
        if "file" not in example:  # which the loader replaces by its content
            by_name[name].model_validate_json(to_json(example))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            "phases.0.motion={kind: circle, radius_m: 0.05, speed_m_s: 1, ramp_s: 1}",
            "0.05 should not be valid",
        ),
        ("phases.0.motion={kind: path}", "is not valid under any of the given schemas"),
        (
            "phases.0.motion={kind: path, file: a.csv, times_s: [0, 1], points_m: []}",
            "is not valid under any",
        ),
        ("phases.0.motion={kind: waypoints, points_m: [[2e3, 0, 0]], speed_m_s: 1, ramp_s: 1}", "maximum"),
        ("formations_m.Wide={kind: line, spacing_m: 1}", "'Wide' does not match"),
        ("formations_m.wide={kind: line}", "is not valid under any of the given schemas"),
        ("formations_m.wide.follower_1=[-1, 2, 2000]", "is not valid under any of the given schemas"),
        ("team.followers=64", "64 is not valid under any of the given schemas"),
        ("sensing=nearest", "'nearest' is not valid under any"),
        ("controller={file: team, horizon: 3}", "is not valid under any of the given schemas"),
        ("controller={horizon_steps: 3}", "is not valid under any of the given schemas"),
        ("seed=-1", "-1 is less than the minimum of 0"),
        ("vehicle=12", "12 is not valid under any of the given schemas"),
    ],
)
def test_what_the_loader_refuses_before_it_validates(change: str, message: str) -> None:
    """Hand cases where a JSON Schema is not simply that of the field."""
    kind = KINDS["scenario"]
    tree = read_mapping(CONFIG_FOLDER / "scenarios/paper.yaml")
    key, _, text = change.partition("=")
    *parents, last = key.split(".")
    node: Any = tree
    for part in parents:
        node = node[int(part) if part.isdecimal() else part]
    node[last] = parse_value(text)
    found = [
        each.message for top in validator(kind).iter_errors(tree) for each in (top, *(top.context or ()))
    ]
    assert any(message in each for each in found), found
    with pytest.raises(ConfigError):
        load_scenario_text(to_text(tree), "changed")


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"start_timeout_s": 0.05}, "0.05 is less than the minimum of 0.1"),
        ({"weights": {"formation_per_m2": 0.0}}, "0.0 is less than or equal to the minimum of 0"),
        ({"weights": {"formation": 5.0}}, "'formation' was unexpected"),
        ({"failsafe": None}, "None is not of type 'object'"),
        ({"observers": "/recorder"}, "'/recorder' is not of type 'array'"),
        ({"output": "runs/by_hand"}, None),  # of the recorder
    ],
)
def test_parameters_of_nodes(parameters: dict[str, Any], message: str | None) -> None:
    found = problems(KINDS["nodes"], {"/**": {"ros__parameters": parameters}})
    assert len(found) == (0 if message is None else 1)
    assert all(message is not None and message in each for each in found)


def test_installed_files_find_their_schema() -> None:
    path = installed_configs("scenario")["paper"]
    _, _, named = path.read_text().partition("\n")[0].partition("$schema=")
    installed = path.parent / named
    assert json.loads(installed.read_text()) == KINDS["scenario"].json_schema


def test_controller_of_an_older_recording_fulfils_the_schema() -> None:
    tree = read_mapping(CONFIG_FOLDER / "controller/team.yaml") | {"formation_ramp_s": 0.0}
    assert problems(KINDS["controller"], tree) != []
    del tree["formation_change"]
    assert problems(KINDS["controller"], tree) == []
