"""Schema of a path of the leader that is given by samples: points, and perhaps yaws, over time."""

import math
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import numpy as np
from pydantic import ConfigDict, Field, model_validator

from relform_core.schema import Schema, Vector3
from relform_core.units import DEGREES

if TYPE_CHECKING:  # it takes a tenth of a second, which only flights with such a path need
    from scipy.interpolate import CubicSpline

SAMPLES_MAX = 2000
"""Bound on the samples of a path: each node reads all of them."""
EXTENT_MAX = 1000.0
"""Bound on the distance of a sample from the first one, along each axis [m]."""
_HEIGHTS_PER_S = 20.0
"""Number of heights that are computed, by time."""


def _or_file(schema: dict[str, Any]) -> None:
    """State in the JSON Schema that ``file`` may stand in place of the samples (``phase_files``)."""
    samples = {key: value for key, value in schema["properties"].items() if key != "kind"}
    file = {
        "description": "CSV file with the samples, relative to the scenario, in place of the other keys.",
        "examples": ["../paths/tower.csv"],
        "type": "string",
    }
    schema["properties"] = {"kind": schema["properties"]["kind"], "file": file, **samples}
    schema["required"] = ["kind"]
    schema["oneOf"] = [
        {"required": ["file"], "properties": dict.fromkeys(samples, False)},
        {"required": ["times_s", "points_m"], "properties": {"file": False}},
    ]


class RecordedPath(Schema):
    """Fly along a cubic spline through samples, from rest to rest.

    The path is moved and turned as a whole, so that its first sample is at the leader's pose at the start of
    the motion. A scenario file names a CSV file with the samples, or lists them.
    """

    model_config = ConfigDict(json_schema_extra=_or_file)

    kind: Literal["path"]
    times: Annotated[
        tuple[float, ...],
        Field(alias="times_s", min_length=2, max_length=SAMPLES_MAX, examples=[[0.0, 1.5, 3.0]]),
    ]
    """Instant of each sample, increasing; only differences matter."""
    points: Annotated[
        tuple[Vector3, ...],
        Field(alias="points_m", examples=[[[0.0, 0.0, 2.0], [0.5, 0.3, 2.0], [1.0, 0.5, 2.2]]]),
    ]
    """x, y and z of each sample, z up."""
    yaws: Annotated[
        tuple[Annotated[float, DEGREES], ...] | None, Field(alias="yaws_deg", examples=[[0.0, 20.0, 30.0]])
    ] = None
    """Yaw of each sample; null: the leader keeps the yaw that it has at the start, and x is forward."""

    @property
    def time(self) -> float:
        """Time from rest to rest [s]."""
        return self.times[-1] - self.times[0]

    @property
    def heights(self) -> tuple[float, ...]:
        """Heights along the path relative to its start [m]; the last one is at its end."""
        times = np.linspace(0.0, self.time, 2 + math.ceil(self.time * _HEIGHTS_PER_S))
        return tuple(self.spline(times)[:, 2].tolist())

    @cached_property
    def spline(self) -> "CubicSpline":
        """x (forward), y (to the left), z [m] and yaw [rad] relative to the start, by time since it [s]."""
        from scipy.interpolate import CubicSpline

        yaws = np.unwrap(self.yaws) if self.yaws is not None else np.zeros(len(self.times))
        x, y, z = (np.array(self.points) - self.points[0]).T
        cosine, sine = math.cos(yaws[0]), math.sin(yaws[0])
        places = np.stack([cosine * x + sine * y, cosine * y - sine * x, z, yaws - yaws[0]], axis=1)
        return CubicSpline(np.array(self.times) - self.times[0], places, bc_type="clamped")

    @model_validator(mode="after")
    def _possible(self) -> Self:
        n_samples = len(self.times)
        for key, values in (("points_m", self.points), ("yaws_deg", self.yaws)):
            if values is not None and len(values) != n_samples:
                raise ValueError(f"times_s has {n_samples} items, but {key} has {len(values)}")
        for index in range(1, n_samples):
            if self.times[index] <= self.times[index - 1]:
                raise ValueError(
                    f"times_s must increase (got {self.times[index]} after {self.times[index - 1]})"
                )
        for index, point in enumerate(self.points):
            if max(abs(a - b) for a, b in zip(point, self.points[0], strict=True)) > EXTENT_MAX:
                raise ValueError(
                    f"points_m.{index} is at {point}, at most {EXTENT_MAX:g} m from the first is possible"
                )
        return self
