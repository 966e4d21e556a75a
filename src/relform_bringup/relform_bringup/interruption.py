"""Signals of the user during a flight: they are noted, and the flight ends at the next look."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class InterruptionError(Exception):
    """The user ends the flight."""


class Interruption:
    """Notes the first signal that arrives."""

    def __init__(self) -> None:
        self.signal: signal.Signals | None = None

    def note(self, signum: int, frame: FrameType | None) -> None:
        """Handle a signal."""
        self.signal = self.signal or signal.Signals(signum)

    def check(self) -> None:
        """Look for a signal.

        Raises:
            InterruptionError: a signal has arrived.
        """
        if self.signal is not None:
            raise InterruptionError(f"interrupted by {self.signal.name}")


@contextmanager
def interruption_noted() -> Iterator[Interruption]:
    """Within the block, SIGINT, SIGTERM and SIGHUP are only noted."""
    interruption = Interruption()
    signums = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [signal.signal(signum, interruption.note) for signum in signums]
    try:
        yield interruption
    finally:
        for signum, handler in zip(signums, before, strict=True):
            signal.signal(signum, handler)
