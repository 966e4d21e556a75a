"""When the messages of a bag are due: bag time over steady time, with rate, pauses and single steps."""

import math
from dataclasses import dataclass

from relform_core.errors import BagError
from relform_core.units import NANOSECONDS_PER_SECOND


@dataclass(frozen=True)
class PlaybackOptions:
    """How to play a bag."""

    rate: float = 1.0
    """Bag time per steady time."""
    start_offset: float = 0.0
    """Bag time that is skipped at the start [s]."""
    duration: float = -1.0
    """Bag time to play from there on [s]; negative: to the end."""
    until_ns: int = -1
    """Bag time at which to end if that is later; negative: not given."""
    delay: float = 0.0
    """Steady time to wait before each start [s]."""
    loop: bool = False
    start_paused: bool = False

    def __post_init__(self) -> None:
        """Raises BagError if an option is out of its bounds."""
        if not 0.0 < self.rate < math.inf:
            raise BagError(f"rate must be above 0 (got {self.rate})")
        if not 0.0 <= self.start_offset < math.inf:
            raise BagError(f"start offset must be at least 0 s (got {self.start_offset})")
        if not 0.0 <= self.delay < math.inf:
            raise BagError(f"delay must be at least 0 s (got {self.delay})")
        if math.isnan(self.duration):
            raise BagError("duration must be a number (got nan)")

    def start_ns(self, bag_start_ns: int) -> int:
        """Bag time at which to start."""
        return bag_start_ns + round(self.start_offset * NANOSECONDS_PER_SECOND)

    def end_ns(self, bag_start_ns: int) -> int | None:
        """Last bag time to play; None: that of the bag."""
        ends = [self.until_ns] if self.until_ns >= 0 else []
        if 0.0 <= self.duration < math.inf:
            ends.append(self.start_ns(bag_start_ns) + round(self.duration * NANOSECONDS_PER_SECOND))
        return max(ends, default=None)


class Timeline:
    """Bag time that runs, pauses and is changed in speed.

    Steady times are passed in [s]; bag times are integer nanoseconds.
    """

    def __init__(self, bag_time_ns: int, rate: float, now: float, paused: bool) -> None:
        self._bag_time_ns = bag_time_ns
        self._since = now
        self._rate = rate
        self._paused = paused

    @property
    def paused(self) -> bool:
        """Whether bag time stands still."""
        return self._paused

    @property
    def rate(self) -> float:
        """Bag time per steady time while it runs."""
        return self._rate

    def bag_time_ns(self, now: float) -> int:
        """Bag time at a steady time."""
        if self._paused:
            return self._bag_time_ns
        return self._bag_time_ns + round((now - self._since) * self._rate * NANOSECONDS_PER_SECOND)

    def wait_for(self, bag_time_ns: int, now: float) -> float | None:
        """Steady time until a bag time comes [s], at least 0; None while paused."""
        if self._paused:
            return None
        ahead_ns = bag_time_ns - self.bag_time_ns(now)
        return max(0.0, ahead_ns / NANOSECONDS_PER_SECOND / self._rate)

    def toggle_pause(self, now: float) -> None:
        """Pause, or go on."""
        self._settle(self.bag_time_ns(now), now)
        self._paused = not self._paused

    def set_rate(self, rate: float, now: float) -> None:
        """Change the speed from now on; it must be above 0."""
        self._settle(self.bag_time_ns(now), now)
        self._rate = rate

    def jump(self, bag_time_ns: int, now: float) -> None:
        """Go on from another bag time."""
        self._settle(bag_time_ns, now)

    def _settle(self, bag_time_ns: int, now: float) -> None:
        self._bag_time_ns, self._since = bag_time_ns, now
