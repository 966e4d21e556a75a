"""The log of inputs: commanded thrusts, until the vehicles acknowledge what they have flown."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from relform_controller.input_log import InputLog
from relform_core.measurements import TeamMeasurements, VehicleMeasurements
from relform_core.sensors.applied_rotor_speeds import APPLIED_ROTOR_SPEEDS, AppliedRotorSpeeds
from support.scenarios import paper_scenario

CONFIG = paper_scenario().config
NAMES = CONFIG.team.vehicles
PERIOD_NS = CONFIG.period_ns
COEFFICIENT = CONFIG.vehicle.thrust_coefficient
HOVER = np.full((3, 4), CONFIG.vehicle.hover_thrust)


def thrusts(step: int) -> Any:
    """Of all vehicles [N]; every number is another one."""
    return 1.0 + 0.1 * step + 0.01 * np.arange(12).reshape(3, 4)


def planned(step: int) -> Any:
    """By a command: of its interval and the three that follow."""
    return np.stack([thrusts(step) + 0.3 * later for later in range(4)], axis=1)


def arrived(step: int, **reports: AppliedRotorSpeeds) -> TeamMeasurements:
    """Reports that arrive in a step, by vehicle."""
    by_vehicle = {
        name: VehicleMeasurements.collect([(APPLIED_ROTOR_SPEEDS, reports[name])] if name in reports else [])
        for name in NAMES
    }
    return TeamMeasurements(step, step * PERIOD_NS, by_vehicle)


def report(step: int, *flown: Any, command: int | None = None) -> AppliedRotorSpeeds:
    """Thrusts of the intervals until a step, the oldest first, as rotor speeds; the last by this command."""
    command_ns = None if command is None else command * PERIOD_NS
    return AppliedRotorSpeeds(step * PERIOD_NS, PERIOD_NS, np.sqrt(np.array(flown) / COEFFICIENT), command_ns)


def taken(log: InputLog, step: int) -> dict[int, Any]:
    """Thrusts of the changes until a step, none of them in doubt."""
    changes = log.take_changes(step * PERIOD_NS)
    assert not any(inputs.doubt.any() for inputs in changes.values())
    return {start_ns // PERIOD_NS: inputs.thrusts for start_ns, inputs in changes.items()}


def intervals(by_step: Mapping[int, Any]) -> dict[int, Any]:
    """What is expected of ``taken``."""
    return {step: pytest.approx(values) for step, values in by_step.items()}


@pytest.fixture
def log() -> InputLog:
    """Commands for the intervals 2, 3 and 4 of a flight that has begun with a hover."""
    log = InputLog(NAMES, PERIOD_NS, CONFIG.vehicle)
    for step in (2, 3, 4):
        log.command(step * PERIOD_NS, planned(step))
    return log


def test_without_news_vehicles_hover_and_then_fly_the_commands(log: InputLog) -> None:
    assert log.thrusts(PERIOD_NS) == pytest.approx(HOVER)
    assert log.thrusts(3 * PERIOD_NS) == pytest.approx(thrusts(3))


def test_each_interval_is_reported_once_when_it_is_over(log: InputLog) -> None:
    for now, expected in [(1, {0: HOVER}), (2, {1: HOVER}), (4, {2: thrusts(2), 3: thrusts(3)}), (4, {})]:
        assert taken(log, now) == intervals(expected)


def test_an_interval_that_was_flown_otherwise_is_reported_again(log: InputLog) -> None:
    log.take_changes(4 * PERIOD_NS)
    other = 2.0 + np.arange(4)
    log.acknowledge(arrived(4, follower_1=report(4, thrusts(2)[1], other)))
    expected = thrusts(3)
    expected[1] = other
    assert taken(log, 4) == intervals({3: expected})
    assert log.thrusts(3 * PERIOD_NS) == pytest.approx(expected)


def test_the_hover_before_the_first_command_is_acknowledged_too(log: InputLog) -> None:
    for step in (1, 2):
        log.take_changes(step * PERIOD_NS)
    log.acknowledge(arrived(3, leader=report(1, 1.5 * HOVER[0])))
    expected = HOVER.copy()
    expected[0] = 1.5 * HOVER[0]
    assert taken(log, 3) == intervals({0: expected, 2: thrusts(2)})


def test_a_report_makes_up_for_lost_ones_and_old_ones_add_nothing(log: InputLog) -> None:
    log.take_changes(5 * PERIOD_NS)
    flown = [2.0 * thrusts(step)[2] for step in (2, 3, 4)]
    log.acknowledge(arrived(5, follower_2=report(5, *flown)))
    assert list(log.take_changes(5 * PERIOD_NS)) == [2 * PERIOD_NS, 3 * PERIOD_NS, 4 * PERIOD_NS]
    log.acknowledge(arrived(6, follower_2=report(4, *flown[:2])))
    assert list(log.take_changes(6 * PERIOD_NS)) == [5 * PERIOD_NS]


def test_what_was_given_out_does_not_change(log: InputLog) -> None:
    given = taken(log, 3)[2]
    log.acknowledge(arrived(3, leader=report(3, 5.0 * np.ones(4))))
    np.testing.assert_array_equal(given, thrusts(2))


def test_what_a_vehicle_may_still_fly_is_in_doubt(log: InputLog) -> None:
    """The leader has missed command 3. Whether command 4 has reached it is not known."""
    log.acknowledge(arrived(4, leader=report(4, planned(2)[0, 0], planned(2)[0, 1], command=2)))
    assert list(taken(log, 4)) == [2, 3]
    (inputs,) = log.take_changes(5 * PERIOD_NS).values()
    expected = np.zeros((3, 4))
    expected[0] = planned(2)[0, 2] - thrusts(4)[0]
    assert inputs.doubt == pytest.approx(expected)
    assert inputs.thrusts == pytest.approx(thrusts(4))
    log.acknowledge(arrived(6, leader=report(5, planned(2)[0, 1], thrusts(4)[0], command=4)))
    assert taken(log, 5) == intervals({4: thrusts(4)})  # as assumed, and now without doubt


def test_a_plan_that_is_over_and_the_failsafe_leave_no_doubt(log: InputLog) -> None:
    log.take_changes(5 * PERIOD_NS)
    log.acknowledge(arrived(6, leader=report(3, thrusts(2)[0], command=2), follower_1=report(3, HOVER[1])))
    log.command(6 * PERIOD_NS, planned(6))
    assert list(taken(log, 7)) == [2, 6]


def test_old_intervals_are_forgotten(log: InputLog) -> None:
    for step in range(5, 500):
        log.command(step * PERIOD_NS, planned(step))
        flown = [2.0 * thrusts(max(earlier, 0))[0] for earlier in range(step - 20, step)]
        log.acknowledge(arrived(step, leader=report(step, *flown)))
        log.take_changes(step * PERIOD_NS)
    assert log.thrusts(499 * PERIOD_NS - PERIOD_NS)[0] == pytest.approx(flown[-1])
    assert log.thrusts(5 * PERIOD_NS) == pytest.approx(HOVER)  # as if it had never been


def test_without_a_command_the_plan_before_continues(log: InputLog) -> None:
    log.plan_continues(7 * PERIOD_NS)
    assert log.thrusts(7 * PERIOD_NS) == pytest.approx(log.thrusts(99 * PERIOD_NS)), "a hover: no plan"
    log.command(8 * PERIOD_NS, planned(8))
    log.plan_continues(9 * PERIOD_NS)
    assert log.thrusts(9 * PERIOD_NS) == pytest.approx(planned(8)[:, 1])
