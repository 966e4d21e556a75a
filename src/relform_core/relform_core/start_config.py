"""Schema of the start of a flight."""

from typing import Annotated

from pydantic import Field

from relform_core.schema import Schema, Vector3
from relform_core.units import DEGREES

PLACE_MAX = 1000.0
"""Bound on each coordinate of a place in a formation [m]; far beyond what sensors see."""


class StartConfig(Schema):
    """Pose of the leader at the start, airborne and at rest; followers start at their places beside it.

    With ``ground``, all start on the ground below these places, and take off to their heights.
    """

    position: Annotated[Vector3, Field(alias="position_m", examples=[[0.0, 0.0, 2.0]])]
    """Position of the leader in the world frame {n}, z up."""
    yaw: Annotated[float, Field(alias="yaw_deg", ge=-180.0, le=180.0, examples=[20.0]), DEGREES]
    """Yaw of the leader in the world frame {n}."""
    follower_yaw_max: Annotated[
        float, Field(alias="follower_yaw_max_deg", ge=0.0, le=180.0, examples=[60.0]), DEGREES
    ] = 0.0
    """Each follower starts with a yaw relative to the leader's that is drawn between plus and minus this."""
    follower_offset_max: Annotated[
        float, Field(alias="follower_offset_max_m", ge=0.0, le=PLACE_MAX, examples=[0.3])
    ] = 0.0
    """Each follower starts at a point that is drawn from the ball of this radius around its place; points too
    close to other vehicles are drawn again."""
