"""Schema of ``geofence``: where in the world the vehicles may fly."""

import math
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from relform_core.arrays import Array
from relform_core.schema import NonNegative, Positive, Schema, Vector3

Interval = tuple[float, float]
_AXES = ("x", "y", "z")


class GeofenceConfig(Schema):
    """An upright box from the ground up, which no vehicle may leave."""

    x: Annotated[Interval, Field(alias="x_m", strict=False, examples=[[-5.0, 25.0]])]
    """Least and largest x in the world frame {n}."""
    y: Annotated[Interval, Field(alias="y_m", strict=False, examples=[[-10.0, 10.0]])]
    """Least and largest y in the world frame {n}."""
    height_max: Annotated[Positive, Field(alias="height_max_m", examples=[5.0])]
    """Largest height above ground."""
    margin: Annotated[NonNegative, Field(alias="margin_m")] = 0.3
    """How far inside the phases of the scenario, and everything that is asked for in flight, must stay."""
    reaction: Literal["hold", "land"] = "hold"
    """What the team does when a vehicle has left the box, or may have, by two standard deviations of the
    estimate. ``hold``: it brakes, returns into the box, and stays there in formation. ``land``: all vehicles
    land where they are, which needs ``ground``."""

    @property
    def lower(self) -> Vector3:
        """Least coordinates in {n} [m]; the ground is no side of the box."""
        return self.x[0], self.y[0], -math.inf

    @property
    def upper(self) -> Vector3:
        """Largest coordinates in {n} [m]."""
        return self.x[1], self.y[1], self.height_max

    def breach(self, p_N: Array, margin: Array | float = 0.0) -> str | None:
        """Where points leave the box most, in words; None: they do not.

        Args:
            p_N: points in {n} [m], shape (..., 3).
            margin: how far inside they must stay [m], for each coordinate or for all.
        """
        points = p_N.reshape(-1, 3)
        sides = np.stack([np.array(self.lower) - points, points - np.array(self.upper)])
        beyond = sides + np.broadcast_to(margin, p_N.shape).reshape(-1, 3)
        side, point, axis = (int(i) for i in np.unravel_index(np.argmax(beyond), beyond.shape))
        if beyond[side, point, axis] <= 0.0:
            return None
        inner = beyond[side, point, axis] - sides[side, point, axis]
        bound = (self.lower[axis] + inner, self.upper[axis] - inner)[side]
        limit = f"at {('least', 'most')[side]} {bound:.2f} m"
        key = ("x_m", "y_m", "height_max_m")[axis]
        return f"{_AXES[axis]} = {points[point, axis]:.2f} m, {limit} (geofence.{key})"

    def inside(self, p_N: Array, around_N: Array) -> Array:
        """The nearest place inside, with the margin, for all vehicles of a team; itself if they do not fit.

        Args:
            p_N: a place in {n} [m], shape (3,).
            around_N: where the vehicles are relative to it [m], shape (vehicle, 3).
        """
        lower = np.array(self.lower) + self.margin - around_N.min(axis=0)
        upper = np.array(self.upper) - self.margin - around_N.max(axis=0)
        return p_N if (lower > upper).any() else np.clip(p_N, lower, upper)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for key, (least, most) in (("x_m", self.x), ("y_m", self.y)):
            if least + 2.0 * self.margin >= most:
                raise ValueError(
                    f"{key} [{least:g}, {most:g}] has no room within margin_m {self.margin:g} on both sides"
                )
        if self.height_max <= self.margin:
            raise ValueError(f"height_max_m {self.height_max:g} must be more than margin_m {self.margin:g}")
        return self
