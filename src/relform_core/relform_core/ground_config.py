"""Schema of ``ground``: how a team takes off and lands."""

from typing import Annotated, Literal

from pydantic import Field

from relform_core.schema import NonNegative, Positive, Schema


class GroundConfig(Schema):
    """Take-off and landing; each vehicle flies them on its own sensors, straight up and down."""

    climb_speed: Annotated[float, Field(alias="climb_speed_m_s", gt=0.0, le=3.0)] = 0.5
    """Vertical speed of a vehicle that takes off."""
    descent_speed: Annotated[float, Field(alias="descent_speed_m_s", gt=0.0, le=3.0)] = 0.4
    """Vertical speed of a vehicle that lands, downwards."""
    take_off_interval: Annotated[NonNegative, Field(alias="take_off_interval_s")] = 1.0
    """Time between two vehicles that take off, the highest place first."""
    landing: Literal["together", "one_by_one"] = "together"
    """Whether all vehicles land at once, or each after the one before, the lowest first."""
    time: Annotated[Positive, Field(alias="time_s")] = 60.0
    """Length of the flight, time on the ground included."""
    waits: bool = False
    """Whether the team waits for requests; else it takes off, flies the phases and lands."""
