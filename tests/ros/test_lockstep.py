"""The step of each message: announcements and inbox."""

from collections import Counter

import pytest

from relform_ros.lockstep import READY, Announcements, Done, StepInbox, step_at
from relform_ros.rejection import Reason, RejectionError

PERIOD_NS = 50_000_000
A, B = "/a/quadrotor", "/b/quadrotor"


def done(node: str, step: int, *sent: str, fault: str = "") -> Done:
    return Done(node, step, tuple((topic, step * PERIOD_NS) for topic in sent), fault)


def reason_of(error: pytest.ExceptionInfo[RejectionError]) -> Reason:
    return error.value.reason


def test_a_stamp_is_that_of_a_step_or_invalid() -> None:
    assert step_at(7 * PERIOD_NS, PERIOD_NS) == 7
    with pytest.raises(RejectionError, match="350000001 ns") as error:
        step_at(7 * PERIOD_NS + 1, PERIOD_NS)
    assert reason_of(error) is Reason.INVALID


class TestAnnouncements:
    def test_complete_when_all_awaited_have_finished(self) -> None:
        announcements = Announcements([A, B])
        announcements.add(done(A, 0, "/a/imu", "/formation/events"))
        assert not announcements.complete(0)
        announcements.add(done(B, 0, "/b/imu", "/formation/events"))
        assert announcements.complete(0)
        assert announcements.sent(0) == Counter(
            {("/a/imu", 0): 1, ("/b/imu", 0): 1, ("/formation/events", 0): 2}
        )
        assert not announcements.complete(1)

    def test_a_ready_member_has_finished_no_step(self) -> None:
        announcements = Announcements([A])
        announcements.add(done(A, READY))
        announcements.add(done(A, READY))
        assert not announcements.complete(0)

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
        assert announcements.sent(0) == Counter({("/a/imu", 0): 1})
        assert announcements.faulty(0)
        announcements.close(1)
        assert not announcements.complete(0)

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
        assert announcements.sent(3) == Counter(
            {("/a/imu", 3 * PERIOD_NS): 1}
        )  # what was rejected left no trace


class TestInbox:
    @pytest.fixture
    def rejected(self) -> list[Reason]:
        return []

    @pytest.fixture
    def inbox(self, rejected: list[Reason]) -> StepInbox[str]:
        return StepInbox[str](PERIOD_NS, reject=lambda error: rejected.append(error.reason))

    def test_has_what_is_due_when_it_has_arrived(self, inbox: StepInbox[str]) -> None:
        assert inbox.has({})
        assert not inbox.has({0: 1})
        inbox.add(0, "imu of step 0")
        assert inbox.has({0: 1})
        assert inbox.take(0, {0: 1}) == ["imu of step 0"]
        assert inbox.take(1, {}) == []  # it was lost

    def test_order_of_arrival_does_not_matter(self, inbox: StepInbox[str]) -> None:
        inbox.add(PERIOD_NS, "1")
        inbox.add(0, "0")
        assert inbox.take(0, {0: 1}) == ["0"]
        assert inbox.take(1, {PERIOD_NS: 1}) == ["1"]

    def test_several_messages_of_one_stamp(self, inbox: StepInbox[str], rejected: list[Reason]) -> None:
        inbox.add(0, "a")
        assert not inbox.has({0: 2})
        inbox.add(0, "b")
        assert inbox.take(0, {0: 2}) == ["a", "b"]
        assert rejected == []

    def test_a_delayed_message_is_due_in_the_step_that_its_sender_announces(
        self, inbox: StepInbox[str], rejected: list[Reason]
    ) -> None:
        for step in range(4):
            inbox.take(step, {})
        inbox.add(3 * PERIOD_NS, "1 step late")
        inbox.add(PERIOD_NS, "3 steps late")
        inbox.add(4 * PERIOD_NS, "on time")
        due = {4 * PERIOD_NS: 1, PERIOD_NS: 1, 3 * PERIOD_NS: 1}
        assert inbox.take(4, due) == ["3 steps late", "1 step late", "on time"]
        assert rejected == []

    def test_with_a_lead_messages_may_be_due_before_their_stamps(self, rejected: list[Reason]) -> None:
        inbox = StepInbox[str](PERIOD_NS, lambda error: rejected.append(error.reason), lead=3)
        inbox.take(4, {})
        inbox.add(10 * PERIOD_NS, "of a sender in step 7")
        with pytest.raises(RejectionError):
            inbox.add(11 * PERIOD_NS, "of nobody")
        inbox.add(8 * PERIOD_NS, "of a sender in step 5")
        assert inbox.take(5, {8 * PERIOD_NS: 1}) == ["of a sender in step 5"]
        assert inbox.take(6, {}) == []
        assert inbox.take(7, {10 * PERIOD_NS: 1}) == ["of a sender in step 7"]
        assert rejected == []

    def test_a_message_that_no_node_announces_is_rejected_after_two_steps(
        self, inbox: StepInbox[str], rejected: list[Reason]
    ) -> None:
        inbox.take(4, {})
        inbox.add(PERIOD_NS, "from a stranger")
        inbox.take(5, {})
        inbox.take(6, {})
        assert rejected == []  # the sender may be two steps ahead
        inbox.take(7, {})
        assert rejected == [Reason.STALE]
        assert len(inbox) == 0

    def test_the_first_of_too_many_is_taken(self, inbox: StepInbox[str], rejected: list[Reason]) -> None:
        inbox.add(0, "the first one")
        inbox.add(0, "another")
        assert inbox.take(0, {0: 1}) == ["the first one"]
        assert rejected == [Reason.DUPLICATE]

    @pytest.mark.parametrize(
        ("stamp_ns", "reason"), [(8 * PERIOD_NS, Reason.EARLY), (5 * PERIOD_NS + 1, Reason.INVALID)]
    )
    def test_impossible_stamps_are_rejected(
        self, stamp_ns: int, reason: Reason, inbox: StepInbox[str]
    ) -> None:
        inbox.take(4, {})
        with pytest.raises(RejectionError) as error:
            inbox.add(stamp_ns, "another")
        assert reason_of(error) is reason
        assert len(inbox) == 0

    def test_a_node_that_has_not_received_a_tick_accepts_messages_of_the_next_step(
        self, inbox: StepInbox[str]
    ) -> None:
        # In step k a vehicle closes step k - 1; the others may have finished k and be in k + 1.
        inbox.take(3, {})
        inbox.add(4 * PERIOD_NS, "4")
        inbox.add(5 * PERIOD_NS, "5")
        assert inbox.take(4, {4 * PERIOD_NS: 1}) == ["4"]
        assert inbox.take(5, {5 * PERIOD_NS: 1}) == ["5"]

    def test_memory_does_not_grow(self, inbox: StepInbox[str]) -> None:
        announcements = Announcements([A])
        for step in range(1000):
            inbox.add(step * PERIOD_NS, "due")
            inbox.add(0, "never due")
            announcements.add(done(A, step))
            inbox.take(step, {step * PERIOD_NS: 1})
            announcements.close(step)
        assert len(inbox) <= 2
        assert len(announcements._steps) <= 2
