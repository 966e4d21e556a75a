"""When a recorder goes on in the next file of its bag."""

from dataclasses import dataclass

from relform_core.errors import BagError
from relform_core.units import NANOSECONDS_PER_SECOND

SIZE_MIN = 1024
"""As in rosbag2."""


@dataclass(frozen=True)
class SplitLimits:
    """How large and how long a file of a bag may get, in the sense of ``ros2 bag record``; 0: no limit."""

    size: int = 0
    """Bytes that are in a file; what was not written yet, one chunk at most, is added."""
    duration_s: int = 0
    """Between the first and the last log time of a file [s]."""

    def __post_init__(self) -> None:
        """Raises BagError if a limit is out of its bounds."""
        if self.size != 0 and self.size < SIZE_MIN:
            raise BagError(
                f"max bag size must be at least {SIZE_MIN} bytes, or 0 for no limit (got {self.size})"
            )
        if self.duration_s < 0:
            raise BagError(
                f"max bag duration must be at least 1 s, or 0 for no limit (got {self.duration_s})"
            )

    def are_reached(self, size: int, first_ns: int | None, now_ns: int) -> bool:
        """Whether a message goes into the next file.

        Args:
            size: bytes of the file that is open.
            first_ns: log time of its first message; None: it has none, and takes at least one.
            now_ns: that of the message.
        """
        if first_ns is None:
            return False
        too_large = 0 < self.size <= size
        too_long = 0 < self.duration_s * NANOSECONDS_PER_SECOND < now_ns - first_ns
        return too_large or too_long
