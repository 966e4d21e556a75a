"""The packets of one direction of a vehicle's link: which of them are lost, and when the others arrive."""

from collections.abc import Sequence

import numpy as np

from relform_core.events_config import LinkFault
from relform_core.links_config import DirectionConfig
from relform_core.units import NANOSECONDS_PER_SECOND, seconds_to_ns
from relform_sim.loss import Loss


class Packets:
    """All that is sent at one instant travels in one packet: it is lost, or it arrives, as a whole.

    Losses, bursts and delays have generators of their own, so that one does not change the draws of another.
    Every packet takes one draw of loss and one of delay, so that an event affects no other packets.

    Args:
        config: of the direction.
        events: that act on this direction of this link.
        generator: the parent of the generators.
    """

    def __init__(
        self, config: DirectionConfig, events: Sequence[LinkFault], generator: np.random.Generator
    ) -> None:
        of_loss, of_bursts, self._of_delay = generator.spawn(3)
        self._config = config
        self._events = tuple(events)
        self._loss = Loss(of_loss, config.loss_probability, events)
        self._bursts = None if config.burst_interval is None else Bursts(config, of_bursts)
        self._newest: tuple[int, int | None] | None = None
        """Instants at which the last packet was sent and arrives [ns]."""

    def arrival_ns(self, now_ns: int) -> int | None:
        """When the packet that is sent at an instant arrives [ns]; None: it is lost.

        The instants of the calls never decrease.
        """
        if self._newest is None or self._newest[0] != now_ns:
            self._newest = now_ns, self._draw(now_ns)
        return self._newest[1]

    def _draw(self, now_ns: int) -> int | None:
        time = now_ns / NANOSECONDS_PER_SECOND
        is_lost = self._loss.loses(time)
        share = float(self._of_delay.uniform())
        in_burst = self._bursts is not None and self._bursts.covers(time)
        if is_lost or in_burst:
            return None
        acting: list[DirectionConfig | LinkFault] = [self._config]
        acting += [event for event in self._events if event.active(time)]
        return now_ns + seconds_to_ns(sum(each.delay + share * each.jitter for each in acting))


class Bursts:
    """Bursts of loss, as a process in time that does not depend on what is sent."""

    def __init__(self, config: DirectionConfig, generator: np.random.Generator) -> None:
        """The direction must have bursts."""
        assert config.burst_interval is not None
        self._length = config.burst
        self._interval = config.burst_interval
        self._generator = generator
        self._start = float(generator.exponential(self._interval))
        """Of the present burst, or of the next one [s]."""

    def covers(self, time: float) -> bool:
        """Whether there is a burst at a time [s]; the times of the calls never decrease."""
        while time >= self._start + self._length:
            self._start += self._length + float(self._generator.exponential(self._interval))
        return time >= self._start
