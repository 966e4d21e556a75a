"""A variant of a sweep: the scenario with some keys changed."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, JsonValue

from relform_core.config_files import is_plain_name
from relform_core.errors import ConfigError
from relform_core.load import SECTIONS_IN_FILES
from relform_core.schema import Label, Schema

NAME_LENGTH = 64
"""Characters of a name at most: files are named after it."""


class Variant(Schema):
    """A scenario with some keys changed."""

    name: Annotated[
        str,
        Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=NAME_LENGTH, examples=["one_step"]),
    ]
    """Name of the variant, unique in the file: letters, digits and ``_.-``."""
    title: Annotated[Label, Field(examples=["one SQP step"])]
    """What it is, for people to read."""
    scenario: Annotated[str | None, Field(examples=["five"])] = None
    """Path or plain name of another scenario; null: that of the sweep."""
    set: Annotated[tuple[str, ...], Field(examples=[["controller.solver.sqp_steps_max=1"]])]
    """Changes ``some.key=value`` as of ``--set``; ``[]``: none. Paths are relative to the file."""

    @property
    def parameters(self) -> Mapping[str, JsonValue]:
        """Its place in a grid: the value of each parameter by its key; empty without a grid."""
        return {}

    def problem(self, error: ConfigError) -> str:
        """An error of loading its scenario, as one line or more that name the variant."""
        return f"variant '{self.name}': {error}"

    def relative_to(self, folder: Path) -> Self:
        """The same with the paths of scenarios and whole sections taken from a folder."""
        scenario = None if self.scenario is None else _path_from_folder(self.scenario, folder)
        changes = tuple(_from_folder(override, folder) for override in self.set)
        return self.model_copy(update={"scenario": scenario, "set": changes})


def _from_folder(override: str, folder: Path) -> str:
    key, separator, value = override.partition("=")
    if key.strip() not in SECTIONS_IN_FILES or value.strip().startswith("{"):
        return override
    return f"{key}{separator}{_path_from_folder(value.strip(), folder)}"


def _path_from_folder(reference: str, folder: Path) -> str:
    return reference if is_plain_name(reference) else os.path.normpath(folder / reference)
