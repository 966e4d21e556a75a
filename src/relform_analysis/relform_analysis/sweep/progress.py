"""Progress of a sweep where no terminal shows a live line: in a log, a pipe or a batch job."""

import time
from collections.abc import Callable
from datetime import timedelta

EVERY_S = 5.0
"""A line at most this often [s]."""


class ProgressLines:
    """One line when the flights begin, one every few seconds while they end, and one after the last."""

    def __init__(
        self,
        title: str,
        total: int,
        known: int,
        write: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Write the first line.

        Args:
            title: what is flown.
            total: flights, those of earlier sessions included.
            known: flights of earlier sessions.
            write: takes a line.
            clock: seconds that pass.
        """
        self._title, self._total, self._known = title, total, known
        self._write, self._clock = write, clock
        self._begin = self._written = clock()
        self._flights = "flight" if total == 1 else "flights"
        kept = f", {known} of them flown before" if known else ""
        write(f"{title}: {total} {self._flights}{kept}")

    def update(self, done: int, lost: int) -> None:
        """Tell how many flights have ended, and how many of them did not complete; writes when it is time."""
        now = self._clock()
        if done < self._total and now - self._written < EVERY_S:
            return
        self._written = now
        parts = [f"{done} of {self._total} {self._flights}"] + ([f"{lost} not completed"] if lost else [])
        elapsed, flown = now - self._begin, done - self._known
        if flown > 0 and elapsed > 0.0:
            rate = flown / elapsed
            parts.append(f"{rate:.1f} flights/s" if rate >= 1.0 else f"{60.0 * rate:.1f} flights/min")
            parts.append(
                f"{_duration((self._total - done) / rate)} left"
                if done < self._total
                else f"after {_duration(elapsed)}"
            )
        self._write(f"{self._title}: {', '.join(parts)}")


def _duration(seconds: float) -> str:
    return str(timedelta(seconds=round(seconds)))
