"""The plan of a sweep: variants of a scenario, each with many seeds."""

import hashlib
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import Field, ValidationError

from relform_analysis.sweep.software import flight_software
from relform_core.config_files import find_config, is_plain_name
from relform_core.errors import ConfigError
from relform_core.explain import Origins, explain
from relform_core.load import SECTIONS_IN_FILES, LoadedScenario, load_scenario
from relform_core.schema import Label, Schema
from relform_core.yaml_files import read_mapping


class Variant(Schema):
    """A scenario with some keys changed."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=64)]
    title: Label
    scenario: str | None = None
    """Path or plain name of another scenario; None: that of the sweep."""
    set: tuple[str, ...]
    """Overrides ``some.key=value``, as on the command line."""

    def relative_to(self, folder: Path) -> "Variant":
        """The same with the paths of scenarios and whole sections taken from a folder."""
        scenario = None if self.scenario is None else _path_from_folder(self.scenario, folder)
        changes = tuple(_from_folder(override, folder) for override in self.set)
        return self.model_copy(update={"scenario": scenario, "set": changes})


class VariantFile(Schema):
    """Content of a file of variants."""

    variants: Annotated[tuple[Variant, ...], Field(min_length=1)]


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
        listed = VariantFile.model_validate_json(text).variants
    except ValidationError as error:
        raise ConfigError(explain(error, tree, Origins(str(path)), VariantFile)) from None
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
            if any(change.partition("=")[0].strip() == "seed" for change in changes):
                raise ConfigError("--set seed: a sweep flies many; --seed is the first of them")
            loaded[variant.name] = load_scenario(variant.scenario or scenario, changes, seeds[0]), changes
        except ConfigError as error:
            raise ConfigError(f"variant '{variant.name}': {error}") from None
    # Seed by seed, so that an unfinished sweep has about as many runs of every variant.
    return [
        Run(name, with_first_seed.with_seed(seed), flight_software(), changes)
        for seed in seeds
        for name, (with_first_seed, changes) in loaded.items()
    ]


def _from_folder(override: str, folder: Path) -> str:
    key, separator, value = override.partition("=")
    if key.strip() not in SECTIONS_IN_FILES or value.strip().startswith("{"):
        return override
    return f"{key}{separator}{_path_from_folder(value.strip(), folder)}"


def _path_from_folder(reference: str, folder: Path) -> str:
    return reference if is_plain_name(reference) else os.path.normpath(folder / reference)
