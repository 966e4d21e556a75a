"""The radio link between one vehicle and the controller, in both directions.

A message keeps its own stamp. The link decides when it arrives, or that it is lost. Both runners use it: the
node of a vehicle behind the lock-step barrier, and flights in one process.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from relform_core.events_config import CommandLoss, Dropout
from relform_core.measurements import RotorCommand
from relform_core.randomness import Stream, Streams
from relform_core.scenario_config import ScenarioConfig
from relform_core.sensors.sensor import Measurement, Sensor
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_sim.loss import Loss

T = TypeVar("T")

Reading = tuple[Sensor[Any, Any], Measurement]
"""A measurement and the sensor that made it."""


class Channel(Protocol[T]):
    """One direction of a link. The instants of the calls never decrease."""

    def send(self, now_ns: int, message: T) -> None:
        """Send a message at an instant of simulation time [ns]."""

    def deliver(self, now_ns: int) -> Sequence[T]:
        """What has arrived up to an instant [ns] and was not delivered before, in order of arrival."""


@dataclass(frozen=True)
class Link:
    """Both directions."""

    up: Channel[Reading]
    """Measurements to the controller."""
    down: Channel[RotorCommand]
    """Commands to the vehicle."""


LinkFactory = Callable[[ScenarioConfig, str, Streams], Link]
"""Makes the link of a vehicle from scenario, name and random streams."""


class LossyChannel(Generic[T]):
    """A message is lost, or it arrives at the instant at which it was sent."""

    def __init__(self, loss_of: Callable[[T], Loss]) -> None:
        """The loss that acts on each message."""
        self._loss_of = loss_of
        self._arrived: list[T] = []

    def send(self, now_ns: int, message: T) -> None:
        """Send a message at an instant of simulation time [ns]."""
        if not self._loss_of(message).loses(now_ns / NANOSECONDS_PER_SECOND):
            self._arrived.append(message)

    def deliver(self, now_ns: int) -> Sequence[T]:
        """What was sent and not lost since the last call, in this order."""
        arrived, self._arrived = self._arrived, []
        return arrived


def lossy_link(config: ScenarioConfig, name: str, streams: Streams) -> Link:
    """Link of the vehicle ``name``: no delay, the losses of its sensors and of the events that hit it.

    The losses of a sensor draw from the stream of that sensor.
    """
    events = config.events_on(name)
    dropouts = [event for event in events if isinstance(event, Dropout)]
    of_sensor = {
        sensor.name: Loss(
            streams[sensor.stream],
            config.sensors.of(sensor).message_loss,
            [event for event in dropouts if event.sensor == sensor.name],
        )
        for sensor in config.sensors_of(name)
    }
    of_commands = Loss(
        streams[Stream.LINK], events=[event for event in events if isinstance(event, CommandLoss)]
    )

    def loss_of_reading(reading: Reading) -> Loss:
        return of_sensor[reading[0].name]

    return Link(LossyChannel(loss_of_reading), LossyChannel(lambda command: of_commands))
