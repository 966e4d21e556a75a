"""Schema of the soft constraints of the controller, and of the obstacles of a scenario."""

from typing import Annotated, Literal

from pydantic import Field

from relform_core.schema import Name, NonNegative, Positive, PositiveVector3, Schema, Vector3
from relform_core.units import DEGREES


class Prices(Schema):
    """What a violation costs: price * violation + 1/2 square_price * violation^2, with its unit squared.

    A constraint holds exactly where it can if its linear price is above what the violation would gain.
    """

    price: Annotated[Positive, Field(alias="price_per_unit")]
    """Per metre, radian or metre per second."""
    square_price: Annotated[NonNegative, Field(alias="square_price_per_unit2")]


class TiltConstraint(Prices):
    """The angle between the body's z and the vertical."""

    max: Annotated[float, Field(alias="max_deg", gt=0.0, lt=90.0), DEGREES]


class SpeedConstraint(Prices):
    """The speed of each vehicle."""

    max: Annotated[Positive, Field(alias="max_m_s")]


class SeparationConstraint(Prices):
    """The distance of every pair of vehicles."""

    min: Annotated[Positive, Field(alias="min_m")]


class FieldOfViewConstraint(Prices):
    """The target stays in a cone about an axis of the observer's body, and within range."""

    axis_azimuth: Annotated[float, Field(alias="axis_azimuth_deg", ge=-180.0, le=180.0), DEGREES]
    axis_elevation: Annotated[float, Field(alias="axis_elevation_deg", ge=-90.0, le=90.0), DEGREES]
    half_angle: Annotated[float, Field(alias="half_angle_deg", gt=0.0, lt=180.0), DEGREES]
    range_max: Annotated[Positive, Field(alias="range_max_m")]
    pairs: Annotated[tuple[Annotated[tuple[Name, Name], Field(strict=False)], ...], Field(strict=False)]
    """(observer, target) by name."""


class KeepOutConstraint(Prices):
    """The distance of every vehicle from the obstacles of the scenario."""

    margin: Annotated[NonNegative, Field(alias="margin_m")]


class ConstraintsConfig(Schema):
    """Soft constraints; those that are left out do not exist."""

    tilt: TiltConstraint | None = None
    speed: SpeedConstraint | None = None
    separation: SeparationConstraint | None = None
    field_of_view: FieldOfViewConstraint | None = None
    keep_out: KeepOutConstraint | None = None


class SphereObstacle(Schema):
    """A ball in the world."""

    kind: Literal["sphere"]
    center: Annotated[Vector3, Field(alias="center_m")]
    radius: Annotated[Positive, Field(alias="radius_m")]


class BoxObstacle(Schema):
    """An upright box in the world."""

    kind: Literal["box"]
    center: Annotated[Vector3, Field(alias="center_m")]
    size: Annotated[PositiveVector3, Field(alias="size_m")]
    yaw: Annotated[float, Field(alias="yaw_deg", ge=-180.0, le=180.0), DEGREES] = 0.0


Obstacle = Annotated[SphereObstacle | BoxObstacle, Field(discriminator="kind")]
