"""The base of every schema of a configuration file, and the types of its values."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

Name = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]*$", max_length=64)]
"""A name that can be a ROS namespace: lower case, digits and underscores, starting with a letter."""

Label = Annotated[str, StringConstraints(min_length=1, max_length=64)]
"""A title, for people to read."""

Positive = Annotated[float, Field(gt=0.0)]
NonNegative = Annotated[float, Field(ge=0.0)]
Probability = Annotated[float, Field(ge=0.0, le=1.0)]
Vector3 = tuple[float, float, float]
PositiveVector3 = tuple[Positive, Positive, Positive]
NonNegativeVector3 = tuple[NonNegative, NonNegative, NonNegative]


class Schema(BaseModel):
    """A section of a configuration file: immutable; no unknown or missing keys, no conversions."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, use_attribute_docstrings=True
    )
