"""Bag time over steady time, with rate, pauses and single steps: it says when a message is due."""

from relform_core.units import NANOSECONDS_PER_SECOND


class Timeline:
    """Bag time that runs at a rate, and pauses.

    Steady times are passed in [s]; bag times are integer nanoseconds.
    """

    def __init__(self, bag_time_ns: int, rate: float, now: float, paused: bool) -> None:
        self._bag_time_ns = bag_time_ns
        self._since = now
        self._rate = rate
        self._paused = paused

    @property
    def paused(self) -> bool:
        """Whether bag time is paused."""
        return self._paused

    @property
    def rate(self) -> float:
        """Bag time per steady time while it is not paused."""
        return self._rate

    def bag_time_ns(self, now: float) -> int:
        """Bag time at a steady time."""
        if self._paused:
            return self._bag_time_ns
        return self._bag_time_ns + round((now - self._since) * self._rate * NANOSECONDS_PER_SECOND)

    def wait_for(self, bag_time_ns: int, now: float) -> float | None:
        """Steady time until a bag time is reached [s], at least 0; None while paused."""
        if self._paused:
            return None
        ahead_ns = bag_time_ns - self.bag_time_ns(now)
        return max(0.0, ahead_ns / NANOSECONDS_PER_SECOND / self._rate)

    def toggle_pause(self, now: float) -> None:
        """Pause or resume."""
        self._settle(self.bag_time_ns(now), now)
        self._paused = not self._paused

    def set_rate(self, rate: float, now: float) -> None:
        """Change the rate from now on; it must be above 0."""
        self._settle(self.bag_time_ns(now), now)
        self._rate = rate

    def jump(self, bag_time_ns: int, now: float) -> None:
        """Continue at another bag time."""
        self._settle(bag_time_ns, now)

    def _settle(self, bag_time_ns: int, now: float) -> None:
        self._bag_time_ns, self._since = bag_time_ns, now
