"""The measurements of `ros2 topic hz`, `bw` and `delay` over the last messages. Times are in nanoseconds."""

import math
import sys
from collections import deque
from typing import Protocol


class Meter(Protocol):
    """Takes each message, and reports about once a second."""

    def take(self, now_ns: int, number: int) -> None:
        """Take a message that arrived; each meter defines the number."""

    def report(self, now_ns: int) -> str | None:
        """Two lines, or None if there is nothing to report."""


class RateMeter:
    """How often messages arrive; the number is ignored."""

    def __init__(self, window: int) -> None:
        self._intervals: deque[int] = deque(maxlen=window)
        self._latest: int | None = None
        self._reported: int | None = None

    def take(self, now_ns: int, number: int) -> None:
        if self._latest is not None and now_ns >= self._latest:
            self._intervals.append(now_ns - self._latest)
        elif self._intervals:
            print("time has reset, resetting counters")
            self._intervals.clear()
        self._latest = now_ns

    def report(self, now_ns: int) -> str | None:
        if not self._intervals or self._latest == self._reported:
            return None
        self._reported = self._latest
        rate = 1e9 * len(self._intervals) / (sum(self._intervals) or math.inf)
        return f"average rate: {rate:.3f}\n\t{_spread(self._intervals)}"


class DelayMeter:
    """How old messages are when they arrive; the number is their stamp."""

    def __init__(self, window: int) -> None:
        self._delays: deque[int] = deque(maxlen=window)
        self._has_news = False

    def take(self, now_ns: int, number: int) -> None:
        self._delays.append(now_ns - number)
        self._has_news = True

    def report(self, now_ns: int) -> str | None:
        if not self._delays:
            return None
        if not self._has_news:
            return "no new messages"
        self._has_news = False
        mean_s = 1e-9 * sum(self._delays) / len(self._delays)
        return f"average delay: {mean_s:.3f}\n\t{_spread(self._delays)}"


def _spread(durations_ns: deque[int]) -> str:
    n = len(durations_ns)
    mean = sum(durations_ns) / n
    deviation_s = 1e-9 * math.sqrt(sum((duration - mean) ** 2 for duration in durations_ns) / n)
    lowest_s, highest_s = 1e-9 * min(durations_ns), 1e-9 * max(durations_ns)
    return f"min: {lowest_s:.3f}s max: {highest_s:.3f}s std dev: {deviation_s:.5f}s window: {n}"


class BandwidthMeter:
    """How many bytes arrive; the number is the size of a message [byte]."""

    def __init__(self, window: int) -> None:
        self._messages: deque[tuple[int, int]] = deque(maxlen=window)
        """Times and sizes."""

    def take(self, now_ns: int, number: int) -> None:
        self._messages.append((now_ns, number))

    def report(self, now_ns: int) -> str | None:
        if len(self._messages) < 2:
            return None
        duration_s = 1e-9 * (now_ns - self._messages[0][0])
        if duration_s <= 0.0:
            print("WARNING: time is reset!", file=sys.stderr)
            self._messages.clear()
            return None
        sizes = [size for _, size in self._messages]
        per_second = sum(sizes) / duration_s
        if per_second < 1e3:
            divisor, unit, decimals = 1e0, "B", 0
        elif per_second < 1e6:
            divisor, unit, decimals = 1e3, "KB", 2
        else:
            divisor, unit, decimals = 1e6, "MB", 2
        figures = (per_second, sum(sizes) / len(sizes), min(sizes), max(sizes))
        bandwidth, mean, smallest, largest = (f"{figure / divisor:.{decimals}f} {unit}" for figure in figures)
        return (
            f"{bandwidth}/s from {len(sizes)} messages\n"
            f"\tMessage size mean: {mean} min: {smallest} max: {largest}"
        )
