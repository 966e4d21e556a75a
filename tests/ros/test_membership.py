"""Who is a member of a flight, with a clock that the test sets."""

import pytest

from relform_ros.lockstep import JOINED, READY, Done
from relform_ros.member_changes import change_from_msg, change_to_msg
from relform_ros.membership import SILENCE_S, MemberChange, Membership, Verdict
from relform_ros.rejection import Reason, RejectionError

VEHICLE, CONTROLLER = "/follower_1/quadrotor", "/formation/controller"
CONFIGURATION = "0123456789ab"
FIRST, SECOND, THIRD = 11, 22, 33


class SteadyClock:
    def __init__(self) -> None:
        self.time = 99.25

    def __call__(self) -> float:
        return self.time


@pytest.fixture
def now() -> SteadyClock:
    return SteadyClock()


@pytest.fixture
def membership(now: SteadyClock) -> Membership:
    """Of a flight that has begun."""
    membership = Membership((VEHICLE, CONTROLLER), {CONTROLLER}, CONFIGURATION, now)
    for node in (VEHICLE, CONTROLLER):
        assert not membership.join(joined(node, FIRST), READY)
        membership.heard(node, 0)
    return membership


def joined(node: str, process: int, configuration: str = CONFIGURATION) -> Done:
    return Done(node, JOINED, (), "", configuration, process)


def join(membership: Membership, node: str, process: int, configuration: str = CONFIGURATION) -> None:
    with pytest.raises(RejectionError) as rejected:
        membership.join(joined(node, process, configuration), 7)
    assert rejected.value.reason is Reason.STALE


def test_before_the_start_the_newest_process_is_the_node(now: SteadyClock) -> None:
    membership = Membership((VEHICLE, CONTROLLER), {CONTROLLER}, CONFIGURATION, now)
    assert not membership.join(joined(VEHICLE, FIRST), READY)
    assert not membership.join(joined(VEHICLE, FIRST), READY), "its report came twice"
    assert membership.join(joined(VEHICLE, SECOND), READY)
    assert membership.take_changes() == []


def test_a_process_takes_the_place_of_a_silent_one(membership: Membership, now: SteadyClock) -> None:
    join(membership, CONTROLLER, SECOND)
    now.time += SILENCE_S
    assert membership.admit(8) == []
    now.time += 0.01
    assert membership.admit(9) == [CONTROLLER]
    why = f"nothing was heard from {CONTROLLER} for 0.5 s"
    assert membership.take_changes() == [MemberChange(9, Verdict.ADMITTED, CONTROLLER, SECOND, why)]
    assert membership.take_changes() == []
    join(membership, CONTROLLER, SECOND)  # its report comes twice
    assert membership.admit(10) == []


def test_a_second_process_is_refused_when_the_first_one_goes_on(
    membership: Membership, now: SteadyClock
) -> None:
    join(membership, CONTROLLER, SECOND)
    now.time += 0.05
    membership.heard(CONTROLLER, 8)
    now.time += 10.0
    assert membership.admit(9) == []
    assert membership.take_changes() == [
        MemberChange(
            8, Verdict.REFUSED, CONTROLLER, SECOND, f"another process is {CONTROLLER} and takes part"
        )
    ]
    assert membership.report() == {"members.admitted": 0, "members.refused": 1}


def test_the_first_of_two_that_wait_is_admitted_and_the_other_refused(
    membership: Membership, now: SteadyClock
) -> None:
    now.time += 3.0
    join(membership, CONTROLLER, SECOND)
    join(membership, CONTROLLER, THIRD)
    assert membership.admit(9) == [CONTROLLER]
    membership.heard(CONTROLLER, 10)
    verdicts = {change.process: change.verdict for change in membership.take_changes()}
    assert verdicts == {SECOND: Verdict.ADMITTED, THIRD: Verdict.REFUSED}


@pytest.mark.parametrize(
    ("node", "configuration", "reason"),
    [
        (VEHICLE, CONFIGURATION, "the flight runs, and goes on without this process"),
        (CONTROLLER, "another", "the flight has another configuration"),
    ],
)
def test_refused_at_once(
    node: str, configuration: str, reason: str, membership: Membership, now: SteadyClock
) -> None:
    now.time += 60.0
    join(membership, node, SECOND, configuration)
    assert membership.take_changes() == [MemberChange(7, Verdict.REFUSED, node, SECOND, reason)]
    assert membership.admit(8) == []


def test_decisions_survive_the_wire() -> None:
    change = MemberChange(123, Verdict.REFUSED, CONTROLLER, 2**63 - 1, "it is late")
    msg = change_to_msg(change, stamp_ns=6_150_000_000)
    assert change_from_msg(msg) == change
    assert (msg.header.stamp.sec, msg.header.stamp.nanosec) == (6, 150_000_000)
    msg.kind = 9
    with pytest.raises(RejectionError) as error:
        change_from_msg(msg)
    assert str(error.value) == "kind must be one of 0 (ADMITTED), 1 (REFUSED) (got 9)"
