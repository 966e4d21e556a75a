"""Alarms of the controller: said once when their cause begins, not in every step of it."""

from collections.abc import Mapping

from relform_core.telemetry import Alarm
from relform_core.units import seconds_to_ns

QUIET_S = 1.0
"""A cause that comes back within this time is still the same one [s]."""


class Alarms:
    """Remembers which causes have been said."""

    def __init__(self) -> None:
        self._last_ns: dict[str, int] = {}
        """When each cause last held, by source [ns]."""

    def begin(self, now_ns: int, causes: Mapping[str, str]) -> tuple[Alarm, ...]:
        """The alarms of a control step.

        Args:
            now_ns: its instant; never decreases.
            causes: what holds now, in words, by source.
        """
        quiet_ns = seconds_to_ns(QUIET_S)
        new = [
            source
            for source in causes
            if source not in self._last_ns or now_ns - self._last_ns[source] > quiet_ns
        ]
        self._last_ns |= dict.fromkeys(causes, now_ns)
        return tuple(Alarm(source, causes[source]) for source in new)
