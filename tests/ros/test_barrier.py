"""The barrier alone, with a clock that the test sets."""

import pytest

from relform_ros.barrier import Barrier, DisagreementError, SilentNodeError, VehicleFaultError
from relform_ros.lockstep import JOINED, READY, Done
from relform_ros.rejection import Reason, RejectionError

LEADER, FOLLOWER, CONTROLLER = "/leader/quadrotor", "/follower_1/quadrotor", "/formation/controller"
RECORDER, MONITOR = "/recorder", "/monitor"
CONFIGURATION = "0123456789ab /recorder"
MEMBERS = (LEADER, FOLLOWER, CONTROLLER)


class SteadyClock:
    def __init__(self) -> None:
        self.time = 1234.5

    def __call__(self) -> float:
        return self.time


@pytest.fixture
def now() -> SteadyClock:
    return SteadyClock()


@pytest.fixture
def barrier(now: SteadyClock) -> Barrier:
    return Barrier(
        MEMBERS,
        observers=(),
        configuration=CONFIGURATION,
        n_steps=100,
        period=0.05,
        start_timeout=60.0,
        step_timeout=2.0,
        now=now,
    )


@pytest.fixture
def observed(now: SteadyClock) -> Barrier:
    """A barrier with observers, for a flight of six steps."""
    return Barrier(
        (*MEMBERS, RECORDER, MONITOR),
        observers=(RECORDER, MONITOR),
        configuration=CONFIGURATION,
        n_steps=6,
        period=0.05,
        start_timeout=60.0,
        step_timeout=2.0,
        now=now,
    )


def finish(barrier: Barrier, *nodes: str, fault: str = "") -> None:
    for node in nodes:
        barrier.add(Done(node, barrier.step, (), fault))


def fly(barrier: Barrier, steps: int) -> None:
    for _ in range(steps):
        finish(barrier, *MEMBERS)
        barrier.advance()


def test_a_member_with_another_configuration_ends_the_run(barrier: Barrier) -> None:
    for node in MEMBERS:
        barrier.add(Done(node, JOINED, (), "", CONFIGURATION))
    assert not barrier.complete()
    barrier.add(Done(FOLLOWER, JOINED, (), "", "0123456789ab"))
    with pytest.raises(DisagreementError) as error:
        barrier.complete()
    assert str(error.value) == (
        "/follower_1/quadrotor flies another configuration (0123456789ab instead of 0123456789ab /recorder): "
        "start all nodes with the same scenario file and observers"
    )


def test_a_node_that_joins_a_running_flight_is_ignored(barrier: Barrier) -> None:
    fly(barrier, 3)
    with pytest.raises(RejectionError) as error:
        barrier.add(Done(FOLLOWER, JOINED, (), "", "another"))
    assert error.value.reason is Reason.STALE
    finish(barrier, *MEMBERS)
    assert barrier.complete()


def test_a_step_begins_when_all_have_finished_the_one_before(barrier: Barrier) -> None:
    assert barrier.step == READY
    for step in range(3):
        finish(barrier, CONTROLLER, LEADER)
        assert not barrier.complete()
        finish(barrier, FOLLOWER)
        assert barrier.complete()
        assert barrier.advance() == step
        assert not barrier.complete()


def test_each_step_has_its_own_time_limit(barrier: Barrier, now: SteadyClock) -> None:
    now.time += 59.0
    fly(barrier, 1)
    for _ in range(5):
        now.time += 1.9
        assert not barrier.complete()
        fly(barrier, 1)


def test_late_members_are_named_with_step_time_and_limit(barrier: Barrier, now: SteadyClock) -> None:
    fly(barrier, 44)
    finish(barrier, LEADER)
    now.time += 2.1
    with pytest.raises(SilentNodeError) as error:
        barrier.complete()
    assert error.value.nodes == [FOLLOWER, CONTROLLER]
    assert str(error.value) == (
        "step 43 (2.15 s) not finished within 2 s (lockstep.step_timeout_s): "
        "/follower_1/quadrotor, /formation/controller"
    )


def test_members_that_have_finished_the_last_step_may_leave(barrier: Barrier) -> None:
    fly(barrier, 101)
    finish(barrier, LEADER)
    assert barrier.has_finished(LEADER)
    assert not barrier.has_finished(FOLLOWER)


def test_members_that_are_not_ready_are_named(barrier: Barrier, now: SteadyClock) -> None:
    finish(barrier, CONTROLLER, LEADER)
    now.time += 59.9
    assert not barrier.complete()
    now.time += 0.2
    with pytest.raises(SilentNodeError, match=r"^not ready within 60 s: /follower_1/quadrotor$"):
        barrier.complete()


def test_all_may_finish_at_the_last_moment(barrier: Barrier, now: SteadyClock) -> None:
    finish(barrier, *MEMBERS)
    now.time += 1000.0
    assert barrier.complete()


def test_a_fault_ends_the_run_when_all_have_finished_the_step(barrier: Barrier) -> None:
    fly(barrier, 3)
    finish(barrier, FOLLOWER, fault="follower_1 collided with leader")
    finish(barrier, LEADER)
    assert not barrier.complete()
    finish(barrier, CONTROLLER)
    assert barrier.complete()
    with pytest.raises(
        VehicleFaultError, match=r"^/follower_1/quadrotor in step 2 \(0.10 s\): follower_1 coll"
    ):
        barrier.advance()


def test_a_fault_explains_why_others_are_late(barrier: Barrier, now: SteadyClock) -> None:
    fly(barrier, 3)
    finish(barrier, FOLLOWER, fault="no number")
    now.time += 2.1
    with pytest.raises(VehicleFaultError, match="no number"):
        barrier.complete()


@pytest.mark.parametrize(
    ("done", "reason"),
    [
        (Done("/stranger/quadrotor", 5, (), ""), Reason.FOREIGN),
        (Done(LEADER, 5, (), ""), Reason.DUPLICATE),
        (Done(FOLLOWER, 4, (), ""), Reason.DUPLICATE),
        (Done(FOLLOWER, 3, (), ""), Reason.STALE),
        (Done(FOLLOWER, READY, (), ""), Reason.STALE),
        (Done(FOLLOWER, 6, (), ""), Reason.EARLY),
    ],
)
def test_rejected(barrier: Barrier, done: Done, reason: Reason) -> None:
    fly(barrier, 6)
    finish(barrier, LEADER)
    with pytest.raises(RejectionError) as error:
        barrier.add(done)
    assert error.value.reason is reason
    finish(barrier, FOLLOWER, CONTROLLER)
    assert barrier.advance() == 6


def test_a_member_of_a_running_flight_cannot_become_ready(barrier: Barrier) -> None:
    with pytest.raises(RejectionError, match=r"leader/quadrotor is in step 17, now is -1"):
        barrier.add(Done(LEADER, 17, (), ""))


class TestObservers:
    @pytest.fixture(autouse=True)
    def started(self, observed: Barrier) -> None:
        finish(observed, *MEMBERS, RECORDER)
        assert not observed.complete()  # before the start it waits for them
        finish(observed, MONITOR)
        assert observed.complete()
        assert observed.advance() == 0

    def test_may_be_one_step_behind_but_not_two(self, observed: Barrier) -> None:
        finish(observed, *MEMBERS)
        for step in range(1, 5):
            assert observed.complete()
            assert observed.advance() == step
            finish(observed, *MEMBERS)
            for observer in (RECORDER, MONITOR):
                assert not observed.complete()
                observed.add(Done(observer, step - 1, (), ""))

    def test_an_observer_that_is_too_late_is_named(self, observed: Barrier, now: SteadyClock) -> None:
        finish(observed, *MEMBERS, MONITOR)
        observed.advance()
        finish(observed, *MEMBERS)
        now.time += 2.1
        with pytest.raises(SilentNodeError, match=r"^step 1 \(0.05 s\) .*: /recorder$"):
            observed.complete()

    def test_must_finish_the_last_step(self, observed: Barrier) -> None:
        for _ in range(6):
            finish(observed, *MEMBERS, RECORDER, MONITOR)
            observed.advance()
        finish(observed, *MEMBERS, RECORDER)
        assert not observed.complete()
        finish(observed, MONITOR)
        assert observed.complete()

    def test_must_finish_the_step_of_a_fault(self, observed: Barrier) -> None:
        finish(observed, LEADER, FOLLOWER)
        finish(observed, CONTROLLER, fault="no plan")
        assert not observed.complete()
        finish(observed, RECORDER, MONITOR)
        assert observed.complete()
        with pytest.raises(VehicleFaultError, match="no plan"):
            observed.advance()

    def test_the_barrier_does_not_wait_for_one_that_cannot_continue(self, observed: Barrier) -> None:
        finish(observed, *MEMBERS)
        observed.advance()
        observed.add(Done(RECORDER, 0, (), "disk full"))
        finish(observed, *MEMBERS)
        for step in (0, 1):
            assert not observed.complete()
            observed.add(Done(MONITOR, step, (), ""))
        assert observed.complete()
        with pytest.raises(VehicleFaultError, match=r"^/recorder in step 0 \(0.00 s\): disk full$"):
            observed.advance()

    @pytest.mark.parametrize(
        ("step", "reason"), [(READY, Reason.DUPLICATE), (1, Reason.EARLY), (2, Reason.EARLY)]
    )
    def test_rejected(self, step: int, reason: Reason, observed: Barrier) -> None:
        with pytest.raises(RejectionError) as error:
            observed.add(Done(RECORDER, step, (), ""))
        assert error.value.reason is reason
