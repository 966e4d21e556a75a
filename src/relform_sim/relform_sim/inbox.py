"""The commands that have arrived at a vehicle: which one applies, and what it plans."""

from collections.abc import Iterable

import numpy as np

from relform_core.arrays import Array
from relform_core.flight_modes import Request
from relform_core.measurements import RotorCommand
from relform_core.units import seconds_to_ns

EARLY_MAX = 1.0
"""How long before its stamp a command may arrive [s]."""


class Inbox:
    """Keeps the newest good command.

    A command applies from its stamp on. One that arrives early is kept until then; of one that arrives late,
    its plan for the interval is flown. Only STOP applies as soon as it arrives.
    """

    def __init__(self) -> None:
        self.newest: RotorCommand | None = None
        """Of those that apply already."""
        self.newest_to_fly: RotorCommand | None = None
        """Of those that ask for FLY."""
        self.asks_to_stop = False
        """Whether a command that has arrived asks for STOP."""
        self._early: dict[int, RotorCommand] = {}
        """Those to come, by stamp [ns]."""

    def take(self, stamp_ns: int, commands: Iterable[RotorCommand]) -> int:
        """Take in what has arrived, and let those apply that are due.

        Args:
            stamp_ns: the present instant.
            commands: in order of arrival.
        Returns:
            How many were rejected: malformed, not finite, old, or too early.
        """
        rejected = 0
        for command in commands:
            if not self._is_acceptable(command, stamp_ns):
                rejected += 1
                continue
            self._early[command.stamp_ns] = command
            self.asks_to_stop |= command.request is Request.STOP
        for due_ns in sorted(each for each in self._early if each <= stamp_ns):
            self.newest = self._early.pop(due_ns)
            if self.newest.request is Request.FLY:
                self.newest_to_fly = self.newest
        return rejected

    def _is_acceptable(self, command: RotorCommand, stamp_ns: int) -> bool:
        """Whether a command is well formed, new, newer than the one that applies, and not too early."""
        return (
            command.period_ns > 0
            and command.speeds.shape == (4,)
            and command.predicted_speeds.shape[1:] == (4,)
            and bool(np.isfinite(command.speeds).all())
            and bool(np.isfinite(command.predicted_speeds).all())
            and (self.newest is None or command.stamp_ns > self.newest.stamp_ns)
            and command.stamp_ns not in self._early
            and command.stamp_ns <= stamp_ns + seconds_to_ns(EARLY_MAX)
        )


def planned_speeds(command: RotorCommand, stamp_ns: int, age_max_ns: int) -> Array | None:
    """Rotor speeds of a command for the interval that starts at an instant [rad/s], shape (4,).

    Args:
        command: which applies at this instant.
        stamp_ns: start of the interval.
        age_max_ns: how long its plan may be flown.
    Returns:
        None if its plan is over.
    """
    age_ns = stamp_ns - command.stamp_ns
    intervals_later = age_ns // command.period_ns
    if intervals_later == 0:
        return command.speeds
    if age_ns > age_max_ns or intervals_later > len(command.predicted_speeds):
        return None
    planned: Array = command.predicted_speeds[intervals_later - 1]
    return planned
