"""Schema of ``ground``: how a team takes off and lands."""

from typing import Annotated, Literal

from pydantic import Field

from relform_core.schema import NonNegative, Schema


class GroundConfig(Schema):
    """Take-off and landing; each vehicle flies them on its own sensors, straight up and down."""

    climb_speed: Annotated[float, Field(alias="climb_speed_m_s", gt=0.0, le=3.0)]
    """Vertical speed of a vehicle that takes off."""
    descent_speed: Annotated[float, Field(alias="descent_speed_m_s", gt=0.0, le=3.0)]
    """Vertical speed of a vehicle that lands, downwards."""
    take_off_interval: Annotated[NonNegative, Field(alias="take_off_interval_s")]
    """Time between two vehicles that take off, the highest place first."""
    landing: Literal["together", "one_by_one"]
    """Whether all vehicles land at once, or each after the one before, the lowest first."""
