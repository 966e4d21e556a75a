"""Load a scenario from YAML: resolve the files it names, apply overrides, validate.

A scenario names its vehicle, sensors and controller by the path of another file, relative to its own, or by
the plain name of an installed file. A section with the key ``file`` reads this file, and its other keys
replace those in the file. A motion ``path`` names a CSV file with its samples. The *effective configuration*
is the same scenario with these files, the overrides
and the seed written in; it is a scenario file too.
"""

import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic_core import PydanticSerializationError, to_json
from ruamel.yaml.error import YAMLError

from relform_core.config_files import find_config
from relform_core.errors import ConfigError
from relform_core.explain import Origins, explain
from relform_core.formation_change import FormationChanges
from relform_core.json_schema import json_schema, keys_at
from relform_core.phase_files import phase_problem, read_phase_files
from relform_core.scenario_config import ScenarioConfig
from relform_core.scenario_file import ScenarioFile
from relform_core.suggestions import did_you_mean
from relform_core.yaml_files import parse_mapping, parse_value, problem, read_mapping, to_text

SECTIONS_IN_FILES = ("vehicle", "sensors", "controller")
_NO_PLAIN_VALUE = "holds a value that is neither text, number, list nor mapping"


@dataclass(frozen=True)
class LoadedScenario:
    """A validated scenario, with the text that reproduces it."""

    config: ScenarioConfig
    seed: int
    written: Mapping[str, Any]
    """The effective configuration in the keys and units of the files, without the seed."""

    @cached_property
    def effective_yaml(self) -> str:
        """Text of the effective configuration."""
        return to_text({**self.written, "seed": self.seed})

    @property
    def fingerprint(self) -> str:
        """Equal for equal flights: a hash of configuration and seed, however they are written."""
        text = f"{self.config.model_dump_json()} {self.seed}"
        return hashlib.sha256(text.encode(), usedforsecurity=False).hexdigest()[:12]

    def with_seed(self, seed: int) -> "LoadedScenario":
        """The same scenario with another seed, without loading it again."""
        return replace(self, seed=seed)


def load_scenario(
    scenario: Path | str, overrides: Sequence[str] = (), seed: int | None = None
) -> LoadedScenario:
    """Load and validate a scenario.

    Args:
        scenario: path of its file, or as text also the plain name of an installed one.
        overrides: texts ``some.key=value``; the value is read as YAML, list items are addressed by number.
        seed: seed of every random draw, >= 0; None: the file's own ``seed``, or 0 if it has none.
    Raises:
        ConfigError: one line per problem, each naming file, key, value and bound.
    """
    path = find_config("scenario", scenario)
    return _load(read_mapping(path), str(path), path.parent, overrides, seed)


def load_scenario_text(
    text: str,
    origin: str,
    overrides: Sequence[str] = (),
    seed: int | None = None,
    names_files: bool = True,
) -> LoadedScenario:
    """Load and validate a scenario from its text; paths in it are relative to the working directory.

    Args:
        origin: where the text comes from, for errors.
        overrides, seed: as of ``load_scenario``.
        names_files: whether the text may name other files; overrides may in any case.
    Raises:
        ConfigError: one line per problem, each naming origin, key, value and bound.
    """
    if not names_files:
        _check_names_no_file(parse_mapping(text, origin), origin)
    return _load(parse_mapping(text, origin), origin, Path(), overrides, seed)


def _load(
    tree: dict[str, Any], origin: str, folder: Path, overrides: Sequence[str], seed: int | None
) -> LoadedScenario:
    origins = Origins(origin)
    # Whole sections first: another file of a section is read before one of its keys is changed.
    for override in sorted(
        overrides, key=lambda text: text.partition("=")[0].strip() not in SECTIONS_IN_FILES
    ):
        _apply_override(tree, override, folder, origins)
    for section in SECTIONS_IN_FILES:
        _resolve_section(tree, section, folder, origins)
    read_phase_files(tree, folder, origins)
    if seed is not None:
        tree["seed"] = seed
    checked_seed = _checked_seed(tree.pop("seed", 0), origins)
    try:
        # JSON mode: strict validation of Python objects would refuse a list where a tuple is declared.
        config = ScenarioConfig.model_validate_json(to_json(tree, inf_nan_mode="constants"))
    except PydanticSerializationError:
        raise ConfigError(f"{origin}: {_NO_PLAIN_VALUE}") from None
    except ValidationError as error:
        raise ConfigError(explain(error, tree, origins, ScenarioFile)) from None
    if (problem := FormationChanges(config).scenario_problem()) is not None:
        where = f"{origins.locate_contradiction(())}: phases.{problem.phase_index}.formation"
        raise ConfigError(f"{where}: {problem}; put a phase with another formation before it")
    if (too_fast := phase_problem(config)) is not None:
        index, reason = too_fast
        where = origins.locate_contradiction(("phases", str(index), "motion"))
        raise ConfigError(f"{where}: {reason}")
    return LoadedScenario(config, checked_seed, _written_out(tree, config))


def _check_names_no_file(tree: Mapping[str, Any], origin: str) -> None:
    """Raise ConfigError if an unchecked scenario names a file."""
    phases = tree.get("phases")
    motions = {
        f"phases.{index}.motion": phase.get("motion")
        for index, phase in enumerate(phases if isinstance(phases, list) else ())
        if isinstance(phase, dict)
    }
    sections = {section: tree.get(section) for section in SECTIONS_IN_FILES}
    for key, value in (sections | motions).items():
        if isinstance(value, str) or (isinstance(value, dict) and "file" in value):
            raise ConfigError(f"{origin}: {key}: names a file, but must hold everything itself")


def _written_out(tree: dict[str, Any], config: ScenarioConfig) -> dict[str, Any]:
    """The same with names in place of a number of followers, and with places in place of shapes."""
    tree["team"]["followers"] = list(config.team.followers)
    for name, formation in config.formations.items():
        if "kind" in tree["formations_m"][name] and "kind" not in formation:
            tree["formations_m"][name] = {follower: list(place) for follower, place in formation.items()}
    return tree


def _resolve_section(tree: dict[str, Any], section: str, folder: Path, origins: Origins) -> None:
    """Replace the reference to a section's file by what the file holds."""
    written = tree.get(section)
    replaced: dict[str, Any] = {}
    if isinstance(written, dict) and "file" in written:
        replaced = {key: value for key, value in written.items() if key != "file"}
        written = written["file"]
        if not isinstance(written, str):
            raise ConfigError(f"{origins.locate((section, 'file'))}: must be text (got {written!r})")
    if isinstance(written, str):
        try:
            path = find_config(section, written, folder)
        except ConfigError as error:
            raise ConfigError(f"{origins.locate((section,))}: {error}") from None
        tree[section] = {**read_mapping(path), **replaced}
        origins.files[section] = str(path)
        origins.in_scenario.update((section, key) for key in replaced)


def _apply_override(tree: dict[str, Any], override: str, folder: Path, origins: Origins) -> None:
    key, separator, text = override.partition("=")
    if not separator or not key.strip():
        raise ConfigError(f"--set {override}: must have the form some.key=value")
    value = _override_value(override, text)
    *parents, last = key.strip().split(".")
    if parents:
        _resolve_section(tree, parents[0], folder, origins)
    elif last in SECTIONS_IN_FILES and isinstance(value, str):
        _override_file(tree, last, value, origins)
        return
    origins.overrides.add((*parents, last))
    node: Any = tree
    for depth, name in enumerate(parents):
        known: Sequence[str] = ()
        if isinstance(node, dict) and name not in node:
            known = keys_at(json_schema(ScenarioFile), tree, parents[:depth])
            if name in known:
                node[name] = {}  # a section that the file leaves to its defaults
                origins.overrides.add(tuple(parents[: depth + 1]))
        node = _child(node, name, override, known)
    if isinstance(node, list):
        _child(node, last, override)  # must exist: an override changes an item, it adds none
        node[int(last)] = value
    elif isinstance(node, dict):
        node[last] = value  # a key that the schema does not know is reported by the validation
    else:
        raise ConfigError(f"--set {override}: '{'.'.join(parents)}' holds a value, not keys")


def _override_file(tree: dict[str, Any], section: str, reference: str, origins: Origins) -> None:
    """Use another file for a section; on a command line, paths are relative to the working directory."""
    try:
        path = find_config(section, reference)
    except ConfigError as error:
        raise ConfigError(f"--set {section}={reference}: {error}") from None
    path = Path(os.path.abspath(path))
    tree[section] = read_mapping(path)
    origins.files[section] = str(path)
    origins.in_scenario = {key for key in origins.in_scenario if key[0] != section}


def _override_value(override: str, text: str) -> Any:
    try:
        value = parse_value(text)
        to_json(value, inf_nan_mode="constants")
    except YAMLError as error:
        raise ConfigError(f"--set {override}: the value is not valid YAML: {problem(error)}") from None
    except PydanticSerializationError:
        raise ConfigError(f"--set {override}: {_NO_PLAIN_VALUE}") from None
    return value


def _child(node: Any, name: str, override: str, known: Sequence[str] = ()) -> Any:
    """The value of a key, or an item; ``known`` are keys to suggest."""
    if isinstance(node, dict) and name in node:
        return node[name]
    if isinstance(node, list) and name.isdecimal() and int(name) < len(node):
        return node[int(name)]
    raise ConfigError(f"--set {override}: unknown key '{name}'{did_you_mean(name, known)}")


def _checked_seed(seed: Any, origins: Origins) -> int:
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise ConfigError(f"{origins.locate(('seed',))}: must be a whole number of at least 0 (got {seed!r})")
    return seed
