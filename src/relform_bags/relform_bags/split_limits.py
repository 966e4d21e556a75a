"""When a recorder continues in the next file of its bag."""

from dataclasses import dataclass

from relform_core.errors import BagError
from relform_core.units import NANOSECONDS_PER_SECOND

SIZE_MIN = 1024
"""As in rosbag2."""


@dataclass(frozen=True)
class SplitLimits:
    """Largest size and duration of a file of a bag, as in ``ros2 bag record``; 0: no limit."""

    size: int = 0
    """Bytes in the file when it ends; one chunk, at most, is added to it."""
    duration_s: int = 0
    """From the first to the last log time of a file [s]."""

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
        """Whether a message belongs into the next file.

        Args:
            size: bytes in the current file.
            first_ns: least log time in the current file; None: it has no message, and takes at least one.
            now_ns: log time of the message.
        """
        if first_ns is None:
            return False
        too_large = 0 < self.size <= size
        too_long = 0 < self.duration_s * NANOSECONDS_PER_SECOND < now_ns - first_ns
        return too_large or too_long
