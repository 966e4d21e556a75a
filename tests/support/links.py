"""Links for tests."""

from collections.abc import Sequence
from typing import Generic, TypeVar

from relform_core.randomness import Streams
from relform_core.scenario_config import ScenarioConfig
from relform_sim.link import Link

T = TypeVar("T")
DELAY_STEPS = 2


class DelayedChannel(Generic[T]):
    """Delivers everything a fixed time after it was sent."""

    def __init__(self, delay_ns: int) -> None:
        self._delay_ns = delay_ns
        self._under_way: list[tuple[int, T]] = []

    def send(self, now_ns: int, message: T) -> None:
        self._under_way.append((now_ns + self._delay_ns, message))

    def deliver(self, now_ns: int) -> Sequence[T]:
        arrived = [message for arrival_ns, message in self._under_way if arrival_ns <= now_ns]
        self._under_way = self._under_way[len(arrived) :]
        return arrived


def delayed_link(config: ScenarioConfig, name: str, streams: Streams) -> Link:
    """Two control steps in both directions."""
    delay_ns = DELAY_STEPS * config.period_ns
    return Link(DelayedChannel(delay_ns), DelayedChannel(delay_ns))
