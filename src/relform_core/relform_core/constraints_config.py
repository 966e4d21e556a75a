"""Schema of the soft constraints of the controller, and of the obstacles of a scenario."""

from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from relform_core.schema import Name, NonNegative, Positive, PositiveVector3, Schema, Vector3
from relform_core.units import DEGREES


class Prices(Schema):
    """What a violation costs: price * violation + 1/2 square_price * violation^2, with its unit squared.

    A constraint holds exactly where it can if its linear price is above what the violation would gain.
    """

    price: Annotated[Positive, Field(alias="price_per_unit", examples=[300.0])]
    """Cost of a violation per metre, radian or metre per second."""
    square_price: Annotated[NonNegative, Field(alias="square_price_per_unit2", examples=[1000.0])]
    """Cost of half the squared violation, in the same units."""


class TiltConstraint(Prices):
    """The angle between the body's z and the vertical."""

    max: Annotated[float, Field(alias="max_deg", gt=0.0, lt=90.0, examples=[40.0]), DEGREES]
    """Largest tilt."""


class SpeedConstraint(Prices):
    """The speed of each vehicle."""

    max: Annotated[Positive, Field(alias="max_m_s", examples=[1.6])]
    """Highest speed."""


class SeparationConstraint(Prices):
    """The distance of every pair of vehicles."""

    min: Annotated[Positive, Field(alias="min_m", examples=[0.8])]
    """Smallest distance between the centres of two vehicles."""


class FieldOfViewConstraint(Prices):
    """The target stays in a cone about an axis of the observer's body, and within range."""

    axis_azimuth: Annotated[
        float, Field(alias="axis_azimuth_deg", ge=-180.0, le=180.0, examples=[0.0]), DEGREES
    ]
    """Azimuth of the axis in the observer's body frame; 0 is forward, positive is to the left."""
    axis_elevation: Annotated[
        float, Field(alias="axis_elevation_deg", ge=-90.0, le=90.0, examples=[25.0]), DEGREES
    ]
    """Elevation of the axis in the observer's body frame; positive is up."""
    half_angle: Annotated[float, Field(alias="half_angle_deg", gt=0.0, lt=180.0, examples=[35.0]), DEGREES]
    """Largest angle between the axis and the direction to the target."""
    range_max: Annotated[Positive, Field(alias="range_max_m", examples=[5.0])]
    """Largest distance of the target."""
    pairs: Annotated[
        tuple[Annotated[tuple[Name, Name], Field(strict=False)], ...],
        Field(strict=False, examples=[[["follower_1", "leader"]]]),
    ]
    """Observer and target of each pair, by name."""


class KeepOutConstraint(Prices):
    """The distance of every vehicle from the obstacles of the scenario."""

    margin: Annotated[NonNegative, Field(alias="margin_m", examples=[0.5])]
    """Smallest distance of a vehicle's centre from the surface of each obstacle."""


class ConstraintsConfig(Schema):
    """Soft constraints; those that are left out do not exist."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"separation": {"min_m": 0.8, "price_per_unit": 300.0, "square_price_per_unit2": 1000.0}}
            ]
        }
    )

    tilt: TiltConstraint | None = None
    """Bound on the tilt of every vehicle."""
    speed: SpeedConstraint | None = None
    """Bound on the speed of every vehicle."""
    separation: SeparationConstraint | None = None
    """Bound on the distance of every pair of vehicles."""
    field_of_view: FieldOfViewConstraint | None = None
    """Pairs of vehicles that keep each other in view."""
    keep_out: KeepOutConstraint | None = None
    """Bound on the distance of every vehicle from the obstacles of the scenario."""


class SphereObstacle(Schema):
    """A ball in the world."""

    kind: Literal["sphere"]
    center: Annotated[Vector3, Field(alias="center_m", examples=[[9.0, -0.3, 2.6]])]
    """Its centre in the world frame {n}."""
    radius: Annotated[Positive, Field(alias="radius_m", examples=[0.25])]
    """Its radius."""


class BoxObstacle(Schema):
    """An upright box in the world."""

    kind: Literal["box"]
    center: Annotated[Vector3, Field(alias="center_m", examples=[[5.0, 0.6, 1.5]])]
    """Its centre in the world frame {n}."""
    size: Annotated[PositiveVector3, Field(alias="size_m", examples=[[0.3, 0.3, 3.0]])]
    """Lengths of its edges along its own x, y, z."""
    yaw: Annotated[float, Field(alias="yaw_deg", ge=-180.0, le=180.0), DEGREES] = 0.0
    """Yaw of the box; positive turns it to the left."""


Obstacle = Annotated[SphereObstacle | BoxObstacle, Field(discriminator="kind")]
