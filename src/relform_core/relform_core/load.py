"""Load a scenario from YAML: resolve the files it names, apply overrides, validate.

A scenario names its vehicle, sensors and controller by the path of another file, relative to its own. The
*effective configuration* is the same scenario with these files, the overrides and the seed written in; it is
a scenario file too.
"""

import hashlib
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from io import StringIO
from pathlib import Path
from typing import Any, cast

from pydantic import ValidationError
from pydantic_core import PydanticSerializationError, to_json
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from relform_core.errors import ConfigError
from relform_core.explain import Origins, explain
from relform_core.scenario_config import ScenarioConfig

SECTIONS_IN_FILES = ("vehicle", "sensors", "controller")


@dataclass(frozen=True)
class LoadedScenario:
    """A validated scenario, with the text that reproduces it."""

    config: ScenarioConfig
    seed: int
    effective_yaml: str
    written: Mapping[str, Any]
    """The same, its sections included, in the keys and units of the files; without the seed."""

    @property
    def fingerprint(self) -> str:
        """Equal for equal flights: a hash of configuration and seed, however they are written."""
        text = f"{self.config.model_dump_json()} {self.seed}"
        return hashlib.sha256(text.encode(), usedforsecurity=False).hexdigest()[:12]

    def with_seed(self, seed: int) -> "LoadedScenario":
        """The same scenario with another seed, without loading it again."""
        text = re.sub(r"(?m)^seed: .*$", f"seed: {seed}", self.effective_yaml)
        return replace(self, seed=seed, effective_yaml=text)


def load_scenario(path: Path, overrides: Sequence[str] = (), seed: int | None = None) -> LoadedScenario:
    """Load and validate a scenario file.

    Args:
        path: the scenario file.
        overrides: texts ``some.key=value``; the value is read as YAML, list items are addressed by number.
        seed: seed of every random draw, >= 0; None: the file's own ``seed``, or 0 if it has none.
    Raises:
        ConfigError: one line per problem, each naming file, key, value and bound.
    """
    tree = _read_yaml(path)
    origins = Origins(str(path))
    # Whole sections first: another file of a section is read before one of its keys is changed.
    for override in sorted(
        overrides, key=lambda text: text.partition("=")[0].strip() not in SECTIONS_IN_FILES
    ):
        _apply_override(tree, override, path.parent, origins)
    for section in SECTIONS_IN_FILES:
        _resolve_section(tree, section, path.parent, origins)
    if seed is not None:
        tree["seed"] = seed
    tree.setdefault("seed", 0)
    effective_yaml = _to_yaml(tree)
    checked_seed = _checked_seed(tree.pop("seed"), origins)
    try:
        # JSON mode: strict validation of Python objects would refuse a list where a tuple is declared.
        config = ScenarioConfig.model_validate_json(to_json(tree, inf_nan_mode="constants"))
    except PydanticSerializationError:
        raise ConfigError(f"{path}: holds a value that is neither text, number, list nor mapping") from None
    except ValidationError as error:
        raise ConfigError(explain(error, tree, origins)) from None
    return LoadedScenario(config, checked_seed, effective_yaml, tree)


def _read_yaml(path: Path) -> dict[str, Any]:
    try:
        tree = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file") from None
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise ConfigError(f"{path}: cannot be read: not a text file in UTF-8") from None
    except MarkedYAMLError as error:
        line = f":{error.problem_mark.line + 1}" if error.problem_mark else ""
        raise ConfigError(f"{path}{line}: not valid YAML: {error.problem}") from None
    except YAMLError as error:
        raise ConfigError(f"{path}: not valid YAML: {' '.join(str(error).split())}") from None
    if not isinstance(tree, dict) or not all(isinstance(key, str) for key in tree):
        raise ConfigError(f"{path}: must hold a mapping of keys to values at its top level")
    return cast(dict[str, Any], tree)


def _resolve_section(tree: dict[str, Any], section: str, folder: Path, origins: Origins) -> None:
    """Replace the path of a section's file by what it holds."""
    if isinstance(reference := tree.get(section), str):
        path = Path(os.path.normpath(folder / reference))
        tree[section] = _read_yaml(path)
        origins.files[section] = str(path)


def _to_yaml(tree: Mapping[str, Any]) -> str:
    stream = StringIO()
    yaml: Any = YAML(typ="safe", pure=True)  # its attributes are typed as their defaults
    yaml.width = 120
    yaml.default_flow_style = None  # short lists stay on one line
    yaml.sort_base_mapping_type_on_output = False
    yaml.dump(dict(tree), stream)
    return stream.getvalue()


def _apply_override(tree: dict[str, Any], override: str, folder: Path, origins: Origins) -> None:
    key, separator, text = override.partition("=")
    if not separator or not key.strip():
        raise ConfigError(f"--set {override}: must have the form some.key=value")
    try:
        value = YAML(typ="safe", pure=True).load(text)
    except YAMLError:
        raise ConfigError(f"--set {override}: the value is not valid YAML") from None
    *parents, last = key.strip().split(".")
    if parents:
        _resolve_section(tree, parents[0], folder, origins)
    if not parents and last in SECTIONS_IN_FILES and isinstance(value, str):
        value = os.path.abspath(value)  # on a command line, paths are relative to where it is typed
    else:
        origins.overrides.add((*parents, last))
    node: Any = tree
    for name in parents:
        node = _child(node, name, override)
    if isinstance(node, list):
        _child(node, last, override)  # must exist: an override changes an item, it adds none
        node[int(last)] = value
    elif isinstance(node, dict):
        node[last] = value  # a key that the schema does not know is reported by the validation
    else:
        raise ConfigError(f"--set {override}: '{'.'.join(parents)}' holds a value, not keys")


def _child(node: Any, name: str, override: str) -> Any:
    if isinstance(node, dict) and name in node:
        return node[name]
    if isinstance(node, list) and name.isdecimal() and int(name) < len(node):
        return node[int(name)]
    raise ConfigError(f"--set {override}: unknown key '{name}'")


def _checked_seed(seed: Any, origins: Origins) -> int:
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise ConfigError(f"{origins.locate(('seed',))}: must be a whole number of at least 0 (got {seed!r})")
    return seed
