"""Live values: values of the configuration that may be changed in flight.

They have the keys, units, bounds and descriptions of the configuration's schema.
"""

import copy
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, Protocol, Self, TypeVar

from pydantic import ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import to_json

from relform_core.errors import ConfigError
from relform_core.explain import Origins, explain
from relform_core.load import LoadedScenario
from relform_core.schema import Schema
from relform_core.suggestions import did_you_mean
from relform_core.vehicle_config import FailsafeConfig, VehicleConfig

Value = float | tuple[float, ...]

S = TypeVar("S", bound=Schema)


@dataclass(frozen=True)
class LiveValue:
    """Description and bounds of one live value."""

    description: str
    lowest: float = -math.inf
    highest: float = math.inf
    constraint: str = ""
    """Further conditions, in words."""

    @property
    def bounded(self) -> bool:
        """Whether the value has a lower or an upper bound."""
        return self.lowest > -math.inf or self.highest < math.inf


class LiveValues(Protocol):
    """Values that may be changed in flight, one or several together; immutable."""

    @property
    def described(self) -> Mapping[str, LiveValue]:
        """Description of each value, by dotted key."""

    @property
    def values(self) -> Mapping[str, Value]:
        """The present values, by dotted key."""

    def changed(self, changes: Mapping[str, Value]) -> Self:
        """A copy with other values for some keys.

        Raises:
            ConfigError: one line: the key, its bound and the refused value.
        """


class LiveSection(Generic[S]):
    """Live numbers of a section of the configuration, such as ``weights.formation_per_m2`` of a controller.

    Args:
        schema: schema of the section.
        written: the section as its file has it.
        keys: dotted keys of the live values.
    """

    def __init__(self, schema: type[S], written: Mapping[str, Any], keys: Iterable[str]) -> None:
        self._schema = schema
        self._written = written
        self.described: Mapping[str, LiveValue] = {key: describe(schema, key) for key in keys}
        try:
            self.config = schema.model_validate_json(to_json(written, inf_nan_mode="constants"))
        except ValidationError as error:
            raise ConfigError("; ".join(explain(error, written, Origins(""), schema).splitlines())) from None
        self.values: Mapping[str, Value] = {key: float(_get(written, key)) for key in self.described}

    def changed(self, changes: Mapping[str, Value]) -> "LiveSection[S]":
        """A copy with other values.

        Raises:
            ConfigError: one line: the key, its bound and the refused value.
        """
        written = copy.deepcopy(dict(self._written))
        for key, value in changes.items():
            if key not in self.described:
                raise ConfigError(f"{key}: cannot be changed in flight{did_you_mean(key, self.described)}")
            *parents, last = key.split(".")
            _get(written, ".".join(parents))[last] = value
        return LiveSection(self._schema, written, self.described)


def section_keys(prefix: str, schema: type[Schema]) -> tuple[str, ...]:
    """Dotted keys of all values of a section."""
    return tuple(f"{prefix}.{field.alias or name}" for name, field in schema.model_fields.items())


def live_vehicle_values(scenario: LoadedScenario) -> LiveSection[VehicleConfig]:
    """The live values of a vehicle: the limits of its failsafe and of its tilt."""
    keys = ("tilt_max_deg", *section_keys("failsafe", FailsafeConfig))
    return LiveSection(VehicleConfig, scenario.written["vehicle"], keys)


def _get(written: Mapping[str, Any], key: str) -> Any:
    value: Any = written
    for part in filter(None, key.split(".")):
        value = value[part]
    return value


def describe(schema: type[Schema], key: str) -> LiveValue:
    """Description and bounds of the value of a dotted key."""
    *parents, last = key.split(".")
    for parent in parents:
        section = _field(schema, parent).annotation
        assert isinstance(section, type)
        assert issubclass(section, Schema)
        schema = section
    field = _field(schema, last)
    bounds: dict[str, float] = {}
    for constraint in field.metadata:
        bounds |= {
            name: getattr(constraint, name) for name in ("gt", "ge", "lt", "le") if hasattr(constraint, name)
        }
    words = {"gt": "greater than", "lt": "less than"}
    return LiveValue(
        description=" ".join((field.description or "").split()),
        lowest=max(bounds.get("gt", -math.inf), bounds.get("ge", -math.inf)),
        highest=min(bounds.get("lt", math.inf), bounds.get("le", math.inf)),
        constraint=", ".join(f"{words[name]} {bound:g}" for name, bound in bounds.items() if name in words),
    )


def _field(schema: type[Schema], key: str) -> FieldInfo:
    return next(field for name, field in schema.model_fields.items() if key in (field.alias, name))
