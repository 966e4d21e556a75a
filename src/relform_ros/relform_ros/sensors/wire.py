"""Message and conversions of all that vehicles send to the controller, found by name."""

from collections.abc import Collection
from importlib import import_module
from typing import Any, Protocol, cast

from relform_core.sensors.sensor import Source


class Wire(Protocol):
    """Contents of each module. As in ``fields``, only ``from_msg`` checks its argument."""

    MESSAGE: type[Any]

    def to_msg(self, measurement: Any, vehicle: str) -> Any:
        """Message of a measurement of this vehicle."""

    def from_msg(self, msg: Any, vehicle: str, team: Collection[str]) -> Any:
        """Measurement of this vehicle.

        Args:
            team: names of all vehicles.
        Raises:
            RejectionError: the message cannot be used.
        """


def wire(source: Source[Any]) -> Wire:
    """Message and conversions of a kind of measurement, from the module of its name."""
    return cast(Wire, import_module(f"relform_ros.sensors.{source.name}"))
