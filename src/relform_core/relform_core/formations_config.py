"""Schema of ``formations_m``: places of the followers, listed one by one or generated as a shape."""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, TypeAdapter, ValidationError, ValidationInfo

from relform_core import shapes
from relform_core.arrays import Array
from relform_core.errors import ConfigError
from relform_core.explain import Origins, explain
from relform_core.schema import Name, Positive, Schema, Vector3
from relform_core.start_config import PLACE_MAX
from relform_core.units import DEGREES
from relform_core.yaml_files import parse_mapping

_DIGITS = 4
"""Places are rounded to a tenth of a millimetre, so that they are the same on every machine."""


class _Shape(Schema):
    """What all shapes have."""

    spacing: Annotated[Positive, Field(alias="spacing_m", examples=[1.0])]
    """Distance of each vehicle to the closest other one."""
    slope: Annotated[float, Field(alias="slope_deg", ge=-45.0, le=45.0, examples=[20.0]), DEGREES] = 0.0
    """Inclination of the shape; positive: vehicles behind the leader are lower."""


class LineShape(_Shape):
    """Vehicles side by side, the leader in the middle."""

    kind: Literal["line"]


class ColumnShape(_Shape):
    """Vehicles one behind the other."""

    kind: Literal["column"]


class VShape(_Shape):
    """Two arms behind the leader."""

    kind: Literal["v"]
    opening: Annotated[float, Field(alias="opening_deg", ge=60.0, le=180.0), DEGREES] = 90.0
    """Angle between the arms."""


class CircleShape(_Shape):
    """A circle with the leader in front."""

    kind: Literal["circle"]


class GridShape(_Shape):
    """Rows, the leader in the middle of the first."""

    kind: Literal["grid"]
    columns: Annotated[int | None, Field(ge=1, examples=[4])] = None
    """Vehicles in a row; null: the grid is as square as possible."""


class SphereShape(_Shape):
    """A sphere with the leader in front."""

    kind: Literal["sphere"]


Shape = Annotated[
    LineShape | ColumnShape | VShape | CircleShape | GridShape | SphereShape, Field(discriminator="kind")
]
_SHAPE: TypeAdapter[Shape] = TypeAdapter(Shape)


def shape_from_text(text: str, origin: str) -> Shape:
    """A shape from its YAML text.

    Args:
        origin: where the text comes from, for errors.
    Raises:
        ConfigError: one line: no YAML, an unknown shape, or what is wrong with a key of it.
    """
    written = parse_mapping(text, origin)
    try:
        return _SHAPE.validate_python(written)
    except ValidationError as error:
        raise ConfigError("; ".join(explain(error, written, Origins(origin), _SHAPE).splitlines())) from None


def _places(shape: Shape, n_vehicles: int) -> Array:
    """Of all vehicles, leader first, before the slope [m], shape (vehicle, 3)."""
    match shape:
        case LineShape():
            return shapes.line(n_vehicles, shape.spacing)
        case ColumnShape():
            return shapes.column(n_vehicles, shape.spacing)
        case VShape():
            return shapes.v(n_vehicles, shape.spacing, shape.opening)
        case CircleShape():
            return shapes.circle(n_vehicles, shape.spacing)
        case GridShape():
            return shapes.grid(n_vehicles, shape.spacing, shape.columns)
        case SphereShape():
            return shapes.sphere(n_vehicles, shape.spacing)


def places_by_follower(shape: Shape, followers: tuple[str, ...]) -> dict[str, Vector3]:
    """The formation that a shape stands for: each follower relative to the leader [m]."""
    places = shapes.sloped(_places(shape, len(followers) + 1), shape.slope)
    rounded = np.round(places[1:], _DIGITS) + 0.0  # no -0.0
    return {name: (x, y, z) for name, (x, y, z) in zip(followers, rounded.tolist(), strict=True)}


def _generated(written: Any, info: ValidationInfo) -> Any:
    """The places of a shape; what is no shape stays. Without a valid team its error is enough."""
    if not isinstance(written, dict) or isinstance(written.get("kind", ()), list | tuple):
        return written  # a follower may have the name "kind"
    shape = _SHAPE.validate_python(written)
    team = info.data.get("team")
    return {} if team is None else places_by_follower(shape, team.followers)


_Coordinate = Annotated[float, Field(ge=-PLACE_MAX, le=PLACE_MAX)]
_Written = Annotated[
    dict[Name, tuple[_Coordinate, _Coordinate, _Coordinate]],
    Field(
        description="Place of each follower: forward, to the left and up from the leader.",
        examples=[{"follower_1": [-1.0, -0.5, -0.5], "follower_2": [-1.0, 0.5, -0.5]}],
    ),
]
FormationConfig = Annotated[
    dict[Name, Annotated[Vector3, Field(strict=False)]],
    BeforeValidator(_generated, json_schema_input_type=_Written | Shape),
]
"""Position of each follower relative to the leader in {mc} of the leader [m], by follower name. A file may
name a shape in its place, which is replaced by the places on loading."""
