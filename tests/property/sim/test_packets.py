"""Laws of a link over generated configurations: when its messages arrive, and how many."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from relform_core.events_config import LinkFault
from relform_core.links_config import DirectionConfig
from relform_sim.link import RadioChannel
from relform_sim.packets import Packets

PERIOD_NS = 50_000_000
STEPS = 60

times = st.floats(0.0, 0.3)
directions = st.builds(
    lambda loss, delay, jitter, burst: DirectionConfig(
        loss_probability=loss,
        delay_s=delay,
        jitter_s=jitter,
        burst_s=burst,
        burst_interval_s=0.7 if burst > 0.0 else None,
    ),
    st.floats(0.0, 0.9),
    times,
    times,
    st.one_of(st.just(0.0), st.floats(0.05, 0.5)),
)
events = st.lists(
    st.builds(
        lambda start, length, loss, delay, jitter: LinkFault(
            kind="link",
            target="leader",
            start_s=start,
            end_s=start + length,
            loss_probability=loss,
            delay_s=delay,
            jitter_s=jitter,
        ),
        st.floats(0.0, 2.0),
        st.floats(0.05, 2.0),
        st.floats(0.0, 1.0),
        times,
        times,
    ),
    max_size=3,
)


@given(config=directions, faults=events, seed=st.integers(0, 2**32 - 1), gaps=st.sets(st.integers(0, STEPS)))
def test_a_message_arrives_once_at_most_and_within_its_bounds(
    config: DirectionConfig, faults: list[LinkFault], seed: int, gaps: set[int]
) -> None:
    """Gaps: steps in which nobody asks what has arrived."""
    channel = RadioChannel[int](lambda step: None, Packets(config, faults, np.random.default_rng(seed)))
    delivered: dict[int, int] = {}
    for step in range(3 * STEPS):
        if step < STEPS:
            channel.send(step * PERIOD_NS, step)
        if step not in gaps:
            for message in channel.deliver(step * PERIOD_NS):
                assert message not in delivered
                delivered[message] = step
    for sent, step in delivered.items():
        time = 0.05 * sent
        acting = [config, *(event for event in faults if event.start <= time < event.end)]
        delay, jitter = (sum(getattr(each, name) for each in acting) for name in ("delay", "jitter"))
        assert 0.05 * step >= time + delay - 1e-9
        asked = [k for k in range(sent, 3 * STEPS) if k not in gaps and 0.05 * k >= time + delay + jitter]
        assert step <= asked[0]


@pytest.mark.parametrize("loss", [0.1, 0.3])
def test_losses_and_delays_have_their_distributions(loss: float) -> None:
    config = DirectionConfig(loss_probability=loss, delay_s=0.02, jitter_s=0.2)
    packets = Packets(config, (), np.random.default_rng(11))
    arrivals = [packets.arrival_ns(step * PERIOD_NS) for step in range(5000)]
    arrived = [(step, each) for step, each in enumerate(arrivals) if each is not None]
    assert stats.binomtest(len(arrivals) - len(arrived), len(arrivals), loss).pvalue > 1e-3
    delays = [(each - step * PERIOD_NS) * 1e-9 for step, each in arrived]
    assert stats.kstest(delays, stats.uniform(0.02, 0.2).cdf).pvalue > 1e-3


def test_bursts_take_their_share_of_time() -> None:
    """Bursts of 0.5 s that are 2 s apart lose a fifth of all packets, in whole bursts."""
    config = DirectionConfig(burst_s=0.5, burst_interval_s=2.0)
    packets = Packets(config, (), np.random.default_rng(12))
    lost = np.array([packets.arrival_ns(step * PERIOD_NS) is None for step in range(20_000)])
    starts = np.flatnonzero(lost[1:] & ~lost[:-1]) + 1
    lengths = [int(np.argmin(lost[start:])) for start in starts[:-1]]
    assert set(lengths) <= {9, 10, 11, *range(19, 22), *range(29, 32)}  # two may follow each other at once
    gaps = 0.05 * np.diff(starts) - 0.5
    assert stats.ttest_1samp(gaps, 2.0).pvalue > 1e-3
