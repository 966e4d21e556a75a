"""The recent past of a filter: the order of arrival does not matter."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from relform_controller.estimation.timeline import Measured, Timeline
from relform_core.arrays import Array

Story = tuple[str, ...]
"""What a filter did, in words."""
STAMPS_NS = (100, 130, 170, 200)


def correct(known: Story, stamp_ns: int, measured: Measured) -> Story:
    return (*known, f"{stamp_ns}: {sorted(map(str, measured.values()))}") if measured else known


def predict(known: Story, thrusts: Array | None, duration_ns: int) -> Story:
    return (*known, f"+{duration_ns} at {'same' if thrusts is None else thrusts[0, 0]}")


def thrusts(value: float) -> Array:
    return np.full((2, 4), value)


def told(timeline: Timeline[Story, Array], now_ns: int) -> Story:
    return timeline.come_forward(now_ns, correct, predict)


def test_what_was_measured_and_flown_is_told_in_order() -> None:
    timeline: Timeline[Story, Array] = Timeline(100, (), thrusts(1.5))
    timeline.measure(100, ("a", "imu"), "imu")
    timeline.measure(100, ("a", "sonar"), "sonar")
    timeline.command(120, thrusts(2.5))
    timeline.measure(130, ("b", "imu"), "late")
    assert told(timeline, 150) == (
        "100: ['imu', 'sonar']",
        "+20 at 1.5",
        "+10 at 2.5",
        "130: ['late']",
        "+20 at same",
    )


@given(order=st.permutations(range(len(STAMPS_NS))), looks=st.lists(st.booleans(), min_size=4, max_size=4))
def test_the_order_of_arrival_does_not_matter(order: list[int], looks: list[bool]) -> None:
    ordered: Timeline[Story, Array] = Timeline(90, (), thrusts(1.5))
    mixed: Timeline[Story, Array] = Timeline(90, (), thrusts(1.5))
    for k in range(len(STAMPS_NS)):
        ordered.measure(STAMPS_NS[k], ("a", "imu"), k)
        ordered.command(STAMPS_NS[k], thrusts(k + 2.0))
    for k, look in zip(order, looks, strict=True):
        mixed.measure(STAMPS_NS[k], ("a", "imu"), k)
        if look:
            told(mixed, 230)
        mixed.command(STAMPS_NS[k], thrusts(k + 2.0))
        if look:
            told(mixed, 230)
    assert told(mixed, 230) == told(ordered, 230)


def test_nothing_is_computed_twice() -> None:
    corrected: list[int] = []

    def counting(known: Story, stamp_ns: int, measured: Measured) -> Story:
        corrected.append(stamp_ns)
        return known

    timeline: Timeline[Story, Array] = Timeline(100, (), thrusts(1.5))
    for stamp_ns in (100, 150, 200):
        timeline.measure(stamp_ns, ("a", "imu"), "imu")
        timeline.come_forward(stamp_ns, counting, predict)
    assert corrected == [100, 150, 200]
    timeline.measure(150, ("a", "sonar"), "late")
    timeline.come_forward(200, counting, predict)
    assert corrected == [100, 150, 200, 150, 200]


def test_what_is_older_than_the_memory_is_ignored() -> None:
    timeline: Timeline[Story, Array] = Timeline(100, (), thrusts(1.5))
    for stamp_ns in STAMPS_NS:
        timeline.measure(stamp_ns, ("a", "imu"), stamp_ns)
    before = told(timeline, 200)
    timeline.forget(150)
    timeline.measure(130, ("a", "sonar"), "too late")
    timeline.command(130, thrusts(9.0))
    assert told(timeline, 200) == before
    timeline.forget(10_000)
    assert told(timeline, 200) == before
