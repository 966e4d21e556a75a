"""The step of each message: announcements, inbox and tally."""

from collections import Counter

import pytest

from relform_ros.lockstep import READY, Announcements, Done, StepInbox, StepTally, step_at
from relform_ros.rejection import Reason, RejectionError

PERIOD_NS = 50_000_000
A, B = "/a/quadrotor", "/b/quadrotor"


def done(node: str, step: int, *sent: str, fault: str = "") -> Done:
    return Done(node, step, sent, fault)


def reason_of(error: pytest.ExceptionInfo[RejectionError]) -> Reason:
    return error.value.reason


def test_stamp_tells_the_step_or_is_invalid() -> None:
    assert step_at(7 * PERIOD_NS, PERIOD_NS) == 7
    with pytest.raises(RejectionError, match="350000001 ns") as error:
        step_at(7 * PERIOD_NS + 1, PERIOD_NS)
    assert reason_of(error) is Reason.INVALID


class TestAnnouncements:
    def test_known_only_when_all_awaited_have_finished(self) -> None:
        announcements = Announcements([A, B])
        announcements.add(done(A, 0, "/a/imu", "/formation/events"))
        assert announcements.sent(0) is None
        announcements.add(done(B, 0, "/b/imu", "/formation/events"))
        assert announcements.sent(0) == Counter({"/a/imu": 1, "/b/imu": 1, "/formation/events": 2})
        assert announcements.sent(1) is None

    def test_that_a_member_is_ready_says_nothing_about_a_step(self) -> None:
        announcements = Announcements([A])
        announcements.add(done(A, READY))
        announcements.add(done(A, READY))
        assert announcements.sent(0) is None

    def test_faults(self) -> None:
        announcements = Announcements([A, B])
        announcements.add(done(A, 0))
        assert not announcements.faulty(0)
        announcements.add(done(B, 0, fault="hit the ground"))
        assert announcements.faulty(0)
        assert not announcements.faulty(1)

    def test_a_closed_step_can_be_read_until_the_next_one_is_closed(self) -> None:
        announcements = Announcements([A])
        announcements.add(done(A, 0, "/a/imu", fault="hit the ground"))
        announcements.add(done(A, 1))
        announcements.close(0)
        assert announcements.sent(0) == Counter({"/a/imu": 1})
        assert announcements.faulty(0)
        announcements.close(1)
        assert announcements.sent(0) is None

    @pytest.mark.parametrize(
        ("late", "reason"),
        [
            (done("/c/quadrotor", 3), Reason.FOREIGN),
            (done(A, 3), Reason.DUPLICATE),
            (done(A, 2), Reason.STALE),
            (done(A, 6), Reason.EARLY),
        ],
    )
    def test_rejected(self, late: Done, reason: Reason) -> None:
        announcements = Announcements([A, B])
        for step in range(3):
            announcements.add(done(A, step))
        announcements.close(2)
        announcements.add(done(A, 3, "/a/imu"))
        with pytest.raises(RejectionError) as error:
            announcements.add(late)
        assert reason_of(error) is reason
        announcements.add(done(B, 3))
        assert announcements.sent(3) == Counter({"/a/imu": 1})  # what was rejected left no trace


class TestInbox:
    def test_a_step_has_one_message(self) -> None:
        inbox = StepInbox[str](PERIOD_NS)
        assert inbox.received(0) == 0
        inbox.add(0, "imu of step 0")
        assert inbox.received(0) == 1
        assert inbox.take(0) == "imu of step 0"

    def test_order_of_arrival_does_not_matter(self) -> None:
        inbox = StepInbox[int](PERIOD_NS)
        inbox.add(PERIOD_NS, 1)
        inbox.add(0, 0)
        assert (inbox.take(0), inbox.take(1)) == (0, 1)

    def test_taking_a_step_closes_it_and_all_before_and_none_after(self) -> None:
        inbox = StepInbox[int](PERIOD_NS)
        for step in range(3):
            inbox.add(step * PERIOD_NS, step)
        assert inbox.take(1) == 1
        assert inbox.take(1) is None
        assert inbox.received(0) == 0
        assert inbox.take(2) == 2

    @pytest.mark.parametrize(
        ("stamp_ns", "reason"),
        [
            (5 * PERIOD_NS, Reason.DUPLICATE),
            (4 * PERIOD_NS, Reason.STALE),
            (8 * PERIOD_NS, Reason.EARLY),
            (5 * PERIOD_NS + 1, Reason.INVALID),
        ],
    )
    def test_rejected(self, stamp_ns: int, reason: Reason) -> None:
        inbox = StepInbox[str](PERIOD_NS)
        inbox.take(4)
        inbox.add(5 * PERIOD_NS, "the first one")
        with pytest.raises(RejectionError) as error:
            inbox.add(stamp_ns, "another")
        assert reason_of(error) is reason
        assert inbox.take(5) == "the first one"

    def test_a_node_that_has_not_received_a_tick_accepts_messages_of_the_next_step(self) -> None:
        # In step k a vehicle closes step k - 1; the others may have finished k and be in k + 1.
        inbox = StepInbox[int](PERIOD_NS)
        inbox.take(3)
        inbox.add(4 * PERIOD_NS, 4)
        inbox.add(5 * PERIOD_NS, 5)
        assert (inbox.take(4), inbox.take(5)) == (4, 5)

    def test_memory_does_not_grow(self) -> None:
        inbox, tally, announcements = StepInbox[int](PERIOD_NS), StepTally(PERIOD_NS), Announcements([A])
        for step in range(1000):
            inbox.add(step * PERIOD_NS, step)
            tally.add(step * PERIOD_NS)
            announcements.add(done(A, step))
            inbox.take(step)
            tally.close(step)
            announcements.close(step)
        assert max(len(each._steps) for each in (inbox, tally, announcements)) <= 2


class TestTally:
    def test_any_number_of_messages_per_step(self) -> None:
        tally = StepTally(PERIOD_NS)
        assert [tally.add(PERIOD_NS), tally.add(0), tally.add(PERIOD_NS)] == [1, 1, 2]
        assert [tally.received(step) for step in range(3)] == [1, 2, 0]

    def test_rejected(self) -> None:
        tally = StepTally(PERIOD_NS)
        tally.close(1)
        for stamp_ns, reason in (
            (PERIOD_NS, Reason.STALE),
            (9 * PERIOD_NS, Reason.EARLY),
            (1, Reason.INVALID),
        ):
            with pytest.raises(RejectionError) as error:
                tally.add(stamp_ns)
            assert reason_of(error) is reason
