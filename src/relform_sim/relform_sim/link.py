"""The radio link between one vehicle and the controller, in both directions.

A message keeps its own stamp. The link decides when it arrives, or that it is lost. Both runners use it: the
node of a vehicle behind the lock-step barrier, and flights in one process.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Literal, TypeVar

from relform_core.events_config import CommandLoss, Dropout, LinkFault
from relform_core.links_config import PERFECT, DirectionConfig
from relform_core.measurements import RotorCommand
from relform_core.randomness import Stream, Streams
from relform_core.scenario_config import ScenarioConfig
from relform_core.sensors.sensor import Measurement, Source
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_sim.loss import Loss
from relform_sim.packets import Packets

T = TypeVar("T")

Reading = tuple[Source[Any], Measurement]
"""A measurement and what it comes from."""


class RadioChannel(Generic[T]):
    """One direction: sends each message in the packet of its instant, unless the message is lost before.

    The instants of the calls never decrease.

    Args:
        loss_of: the loss that acts on each message before it is sent; None: none does.
        packets: of this direction; None: every packet arrives at the instant at which it is sent.
    """

    def __init__(self, loss_of: Callable[[T], Loss | None], packets: Packets | None = None) -> None:
        self._loss_of = loss_of
        self._packets = packets
        self._under_way: list[tuple[int, T]] = []
        """With the instant of arrival [ns], in the order in which they were sent."""

    def send(self, now_ns: int, message: T) -> None:
        """Send a message at an instant of simulation time [ns]."""
        arrival_ns = now_ns if self._packets is None else self._packets.arrival_ns(now_ns)
        loss = self._loss_of(message)
        is_lost = loss is not None and loss.loses(now_ns / NANOSECONDS_PER_SECOND)
        if arrival_ns is not None and not is_lost:
            self._under_way.append((arrival_ns, message))

    def deliver(self, now_ns: int) -> Sequence[T]:
        """What has arrived since the last call, in the order of arrival, then of sending."""
        arrived = sorted((each for each in self._under_way if each[0] <= now_ns), key=_arrival_ns)
        self._under_way = [each for each in self._under_way if each[0] > now_ns]
        return [message for _, message in arrived]


def _arrival_ns(under_way: tuple[int, Any]) -> int:
    return under_way[0]


@dataclass(frozen=True)
class Link:
    """Both directions."""

    up: RadioChannel[Reading]
    """Measurements to the controller."""
    down: RadioChannel[RotorCommand]
    """Commands to the vehicle."""


def radio_link(config: ScenarioConfig, name: str, streams: Streams) -> Link:
    """Link of the vehicle ``name``: what ``links`` says, the losses of its sensors, and the events on it.

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

    def packets(direction: Literal["up", "down"], of_all: DirectionConfig, stream: Stream) -> Packets | None:
        faults = [
            event
            for event in events
            if isinstance(event, LinkFault) and event.direction in (direction, "both")
        ]
        return None if of_all == PERFECT and not faults else Packets(of_all, faults, streams[stream])

    return Link(
        up=RadioChannel(
            lambda reading: of_sensor.get(reading[0].name), packets("up", config.links.up, Stream.LINK_UP)
        ),
        down=RadioChannel(lambda command: of_commands, packets("down", config.links.down, Stream.LINK_DOWN)),
    )
