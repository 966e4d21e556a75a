"""How old data is when it is used: median, 99% quantile and most, in a bounded memory."""

from collections import Counter
from collections.abc import Mapping

BIN_NS = 50_000
"""Width of the bins in which ages are counted [ns]."""
OLDEST_NS = 1_000_000_000
"""All beyond this share one bin [ns]."""
NANOSECONDS_PER_MILLISECOND = 1_000_000


class Ages:
    """Ages since the start of the flight."""

    def __init__(self) -> None:
        self._bins: Counter[int] = Counter()
        """Number of ages by the number of their bin."""
        self._most_ns = 0

    def add(self, age_ns: int) -> None:
        """Count one."""
        self._bins[min(max(age_ns, 0), OLDEST_NS) // BIN_NS] += 1
        self._most_ns = max(self._most_ns, age_ns)

    def quantile(self, share: float) -> float:
        """The age that this share of all does not exceed, rounded up to a bin [ms]; 0 if there is none."""
        left = share * self._bins.total()
        for number in sorted(self._bins):
            left -= self._bins[number]
            if left <= 0.0:
                return min((number + 1) * BIN_NS, self._most_ns) / NANOSECONDS_PER_MILLISECOND
        return 0.0

    def report(self, what: str) -> Mapping[str, object]:
        """For diagnostics; ``what`` begins the keys."""
        return {
            f"{what}_median_ms": self.quantile(0.5),
            f"{what}_99_percent_ms": self.quantile(0.99),
            f"{what}_most_ms": self._most_ns / NANOSECONDS_PER_MILLISECOND,
        }
