"""Schema of ``config/sensors/*.yaml``: the sensors of every vehicle of a team, and their errors."""

from typing import Any

from pydantic import Field, create_model

from relform_core.schema import Schema
from relform_core.sensors.registry import SENSORS
from relform_core.sensors.sensor import C, Sensor


def _field(sensor: Sensor[Any, Any]) -> Any:
    """Type, default and description of a section."""
    description = sensor.config.__doc__
    if sensor.optional:
        return sensor.config | None, Field(
            default=None, description=f"{description} null: no vehicle has one."
        )
    return sensor.config, Field(description=description)


_Sections: Any = create_model("_Sections", __base__=Schema, **{each.name: _field(each) for each in SENSORS})


class SensorsConfig(_Sections):
    """The sensors of every vehicle of a team: one section per registered sensor, called by its name."""

    def has(self, sensor: Sensor[Any, Any]) -> bool:
        """Whether a sensor is configured; only an optional one may be left out."""
        return getattr(self, sensor.name) is not None

    def of(self, sensor: Sensor[Any, C]) -> C:
        """Section of a sensor.

        Raises:
            LookupError: it was left out.
        """
        section: C | None = getattr(self, sensor.name)
        if section is None:
            raise LookupError(f"sensors.{sensor.name} is not configured")
        return section
