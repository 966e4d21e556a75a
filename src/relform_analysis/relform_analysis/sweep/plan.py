"""The plan of a sweep: variants of a scenario, each with many seeds."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import ConfigDict, Field, JsonValue, ValidationError

from relform_analysis.sweep.grid import grid_variants
from relform_analysis.sweep.software import flight_software
from relform_analysis.sweep.variant import Variant
from relform_core.config_files import find_config
from relform_core.errors import ConfigError
from relform_core.explain import Origins, explain
from relform_core.load import LoadedScenario, load_scenario
from relform_core.schema import Schema
from relform_core.yaml_files import read_mapping


def _one_of_both(schema: dict[str, Any]) -> None:
    """State in the JSON Schema that a file has either variants or a grid."""
    schema["oneOf"] = [
        {"required": ["variants"], "properties": {"variants": {"type": "array"}}},
        {"required": ["grid"], "properties": {"grid": {"type": "object"}}},
    ]


class VariantFile(Schema):
    """Content of a file of variants: either their list, or a grid over parameters."""

    model_config = ConfigDict(json_schema_extra=_one_of_both)

    variants: Annotated[tuple[Variant, ...], Field(min_length=1)] | None = None
    """The variants one by one; null together with ``grid``."""
    grid: Annotated[
        Annotated[dict[str, tuple[JsonValue, ...]], Field(min_length=1)] | None,
        Field(examples=[{"controller.weights.torque_per_n2_m2": [5, 10, 20]}]),
    ] = None
    """Values of each key ``some.key``; every combination is a variant. null together with ``variants``."""


@dataclass(frozen=True)
class Run:
    """One flight of a sweep, with all that another process or machine needs to fly it."""

    variant: str
    scenario: LoadedScenario
    software: str
    """Software of the process that planned the run."""
    changes: tuple[str, ...] = ()
    """Keys that were changed for it, ``some.key=value``: for all variants, then for its own."""
    keeps_log: bool = False
    """Whether the log of the flight is kept beside its row."""

    @property
    def seed(self) -> int:
        """Seed of the flight."""
        return self.scenario.seed

    @property
    def name(self) -> str:
        """Name of its files, without suffix."""
        return f"{self.variant}-s{self.seed}"

    @property
    def fingerprint(self) -> str:
        """Changes with anything that the result depends on."""
        text = f"{self.software}\n{self.scenario.effective_yaml}"
        return hashlib.sha256(text.encode(), usedforsecurity=False).hexdigest()


def load_variants(variants_file: Path | str) -> tuple[Variant, ...]:
    """Read a file of variants. Paths in it are relative to the file.

    Args:
        variants_file: its path, or as text also the plain name of an installed one.
    Raises:
        ConfigError: it cannot be read or used; a line per problem, each with file, key and value.
    """
    path = find_config("variants", variants_file)
    tree = read_mapping(path)
    try:
        text = json.dumps(tree)
    except TypeError:
        raise ConfigError(f"{path}: holds a value that is neither text, number, list nor mapping") from None
    try:
        written = VariantFile.model_validate_json(text)
    except ValidationError as error:
        raise ConfigError(explain(error, tree, Origins(str(path)), VariantFile)) from None
    if (written.variants is None) == (written.grid is None):
        has = "neither variants nor a grid" if written.grid is None else "both variants and a grid"
        raise ConfigError(f"{path}: has {has}; a sweep needs one of them")
    listed = written.variants or grid_variants(written.grid or {}, f"{path}: grid.")
    variants = tuple(variant.relative_to(path.parent) for variant in listed)
    names = [variant.name for variant in variants]
    for name in names:
        if names.count(name) > 1:
            raise ConfigError(f"{path}: variant '{name}' is named twice")
    return variants


def plan_runs(
    scenario: Path | str, variants: Sequence[Variant], overrides: Sequence[str], seeds: Sequence[int]
) -> list[Run]:
    """All flights of a sweep; every configuration is validated before the first one starts.

    Raises:
        ConfigError: the scenario or a variant cannot be used.
    """
    loaded = {}
    for variant in variants:
        changes = (*overrides, *variant.set)
        try:
            _check_keys(overrides, variant)
            loaded[variant.name] = load_scenario(variant.scenario or scenario, changes, seeds[0]), changes
        except ConfigError as error:
            raise ConfigError(variant.problem(error)) from None
    # Seed by seed, so that an unfinished sweep has about as many runs of every variant.
    return [
        Run(name, with_first_seed.with_seed(seed), flight_software(), changes)
        for seed in seeds
        for name, (with_first_seed, changes) in loaded.items()
    ]


def _check_keys(overrides: Sequence[str], variant: Variant) -> None:
    """Refuse changes that a sweep makes itself.

    Raises:
        ConfigError: one line: the key.
    """
    keys = [change.partition("=")[0].strip() for change in (*overrides, *variant.set)]
    if "seed" in keys:
        raise ConfigError("--set seed: a sweep flies many; --seed is the first of them")
    for key in variant.parameters:
        if keys.count(key) > 1:
            raise ConfigError(f"--grid {key}: --set has it, too; leave one of them out")
