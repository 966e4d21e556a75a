"""What belongs to which step: announcements, inbox and tally."""

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
    def test_complete_with_what_was_sent_on_its_topics(self) -> None:
        inbox = StepInbox[str](["/a/imu", "/a/sonar"], PERIOD_NS)
        assert not inbox.has(0, None)
        assert inbox.has(0, {"/a/optic_flow"})  # nothing of it is for this inbox
        inbox.add("/a/imu", 0, "imu of step 0")
        assert inbox.has(0, {"/a/imu"})  # the sonar was lost
        assert not inbox.has(0, {"/a/imu", "/a/sonar"})
        inbox.add("/a/sonar", 0, "sonar of step 0")
        assert inbox.has(0, {"/a/imu", "/a/sonar"})
        assert inbox.at(0) == {"/a/imu": "imu of step 0", "/a/sonar": "sonar of step 0"}

    def test_order_of_arrival_does_not_matter(self) -> None:
        inbox = StepInbox[int](["/a/imu"], PERIOD_NS)
        inbox.add("/a/imu", PERIOD_NS, 1)
        inbox.add("/a/imu", 0, 0)
        assert (inbox.at(0), inbox.at(1)) == ({"/a/imu": 0}, {"/a/imu": 1})

    def test_closing_a_step_forgets_all_before_and_nothing_after(self) -> None:
        inbox = StepInbox[int](["/a/imu"], PERIOD_NS)
        for step in range(3):
            inbox.add("/a/imu", step * PERIOD_NS, step)
        inbox.close(1)
        assert inbox.at(2) == {"/a/imu": 2}
        assert not inbox.has(1, {"/a/imu"})

    @pytest.mark.parametrize(
        ("topic", "stamp_ns", "reason"),
        [
            ("/b/imu", 5 * PERIOD_NS, Reason.FOREIGN),
            ("/a/imu", 5 * PERIOD_NS, Reason.DUPLICATE),
            ("/a/imu", 4 * PERIOD_NS, Reason.STALE),
            ("/a/imu", 8 * PERIOD_NS, Reason.EARLY),
            ("/a/imu", 5 * PERIOD_NS + 1, Reason.INVALID),
        ],
    )
    def test_rejected(self, topic: str, stamp_ns: int, reason: Reason) -> None:
        inbox = StepInbox[str](["/a/imu"], PERIOD_NS)
        inbox.close(4)
        inbox.add("/a/imu", 5 * PERIOD_NS, "the first one")
        with pytest.raises(RejectionError) as error:
            inbox.add(topic, stamp_ns, "another")
        assert reason_of(error) is reason
        assert inbox.at(5) == {"/a/imu": "the first one"}

    def test_a_node_whose_tick_is_late_takes_what_others_send_for_the_next_step(self) -> None:
        # In step k a vehicle closes step k - 1; the others may have finished k and be in k + 1.
        inbox = StepInbox[int](["/a/rotor_speeds"], PERIOD_NS)
        inbox.close(3)
        inbox.add("/a/rotor_speeds", 4 * PERIOD_NS, 4)
        inbox.add("/a/rotor_speeds", 5 * PERIOD_NS, 5)
        assert inbox.at(5) == {"/a/rotor_speeds": 5}


class TestTally:
    def test_complete_when_all_that_was_sent_was_counted(self) -> None:
        tally = StepTally(["/formation/events", "/a/imu"], PERIOD_NS)
        sent = Counter({"/formation/events": 2, "/a/imu": 1, "/not/recorded": 5})
        assert not tally.has(1, None)
        tally.add("/a/imu", PERIOD_NS)
        tally.add("/formation/events", PERIOD_NS)
        assert not tally.has(1, sent)
        assert tally.add("/formation/events", PERIOD_NS) == 2
        assert tally.has(1, sent)

    def test_rejected(self) -> None:
        tally = StepTally(["/a/imu"], PERIOD_NS)
        tally.close(1)
        for stamp_ns, reason in (
            (PERIOD_NS, Reason.STALE),
            (9 * PERIOD_NS, Reason.EARLY),
            (1, Reason.INVALID),
        ):
            with pytest.raises(RejectionError) as error:
                tally.add("/a/imu", stamp_ns)
            assert reason_of(error) is reason
