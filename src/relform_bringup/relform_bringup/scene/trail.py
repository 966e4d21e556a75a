"""The last part of a path."""

from collections import deque
from collections.abc import Iterator

from relform_bringup.scene.poses import Pose


class Due:
    """Whether something that has a period is due, by stamps; the first one is."""

    def __init__(self, period_ns: int) -> None:
        self._period_ns = period_ns
        self._last = -1

    def __call__(self, stamp_ns: int) -> bool:
        """Whether another period has begun since the last time; also if time has gone back."""
        number = stamp_ns // self._period_ns
        is_due = number != self._last
        self._last = number
        return is_due


class Trail:
    """Poses with their instants, thinned out, of which the oldest are forgotten."""

    def __init__(self, spacing_ns: int, length: int) -> None:
        """Keep one pose in each ``spacing_ns``, and at most ``length`` of them."""
        self._due = Due(spacing_ns)
        self._kept: deque[tuple[int, Pose]] = deque(maxlen=length)

    def __iter__(self) -> Iterator[tuple[int, Pose]]:
        return iter(self._kept)

    def __len__(self) -> int:
        return len(self._kept)

    def add(self, stamp_ns: int, pose: Pose) -> None:
        """Add a pose; if time has gone back, a new path begins."""
        if self._kept and stamp_ns < self._kept[-1][0]:
            self._kept.clear()
        if self._due(stamp_ns):
            self._kept.append((stamp_ns, pose))
