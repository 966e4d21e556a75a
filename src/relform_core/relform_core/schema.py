"""The base of every schema of a configuration file, and the types of its values.

A field is the one place for all that is known of a key: ``Field`` has its name, bounds and an example, its
docstring the meaning. Loading, error messages, docs/configuration.md and the JSON Schemas for editors all
read it there. Defaults are in the unit of the file.
"""

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    StringConstraints,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

Name = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]*$", max_length=64)]
"""A name that can be a ROS namespace: lower case, digits and underscores, starting with a letter."""

LABEL_LENGTH = 64
Label = Annotated[str, StringConstraints(min_length=1, max_length=LABEL_LENGTH)]
"""A title, for people to read."""

Positive = Annotated[float, Field(gt=0.0)]
NonNegative = Annotated[float, Field(ge=0.0)]
Probability = Annotated[float, Field(ge=0.0, le=1.0)]
Vector3 = tuple[float, float, float]
PositiveVector3 = tuple[Positive, Positive, Positive]
NonNegativeVector3 = tuple[NonNegative, NonNegative, NonNegative]


@dataclass(frozen=True)
class Magnitude:
    """Annotation of a number of either sign: bounds on its magnitude."""

    lowest: float
    highest: float | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Check the bounds on loading."""
        return core_schema.no_info_after_validator_function(self._checked, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """The same bounds for editors."""
        bounds: JsonSchemaValue = {"not": {"exclusiveMinimum": -self.lowest, "exclusiveMaximum": self.lowest}}
        if self.highest is not None:
            bounds |= {"minimum": -self.highest, "maximum": self.highest}
        return {**handler(schema), **bounds}

    def _checked(self, value: float) -> float:
        if abs(value) < self.lowest or (self.highest is not None and abs(value) > self.highest):
            upper = "" if self.highest is None else f" and at most {self.highest:g}"
            raise ValueError(f"must be at least {self.lowest:g}{upper} in magnitude (got {value})")
        return value


def by_kind(written: Any) -> Any:
    """The section that a file gives by the name of its kind alone; anything else stays."""
    return {"kind": written} if isinstance(written, str) else written


class Schema(BaseModel):
    """A section of a configuration file: immutable; no unknown or missing keys, no conversions."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        strict=True,
        allow_inf_nan=False,
        use_attribute_docstrings=True,
        validate_default=True,
    )
