"""What nodes count and keep in real time, with a clock that the test sets."""

import pytest

from relform_ros.ages import Ages
from relform_ros.arrivals import Arrivals, Arrived
from relform_ros.barrier import SilentNodeError, VehicleFaultError
from relform_ros.flight_time import FlightTime
from relform_ros.lockstep import JOINED, READY, Done
from relform_ros.membership import Verdict
from relform_ros.metronome import Metronome
from relform_ros.rejection import Reason, RejectionError

LEADER, CONTROLLER, RECORDER = "/leader/quadrotor", "/formation/controller", "/recorder"
IMU, COMMAND = "/leader/imu", "/leader/rotor_speeds"
MS = 1_000_000
PERIOD_NS = 50 * MS


class SteadyClock:
    def __init__(self) -> None:
        self.time = 1234.5

    def __call__(self) -> float:
        return self.time

    def ns(self) -> int:
        return round(self.time * 1e9)


@pytest.fixture
def now() -> SteadyClock:
    return SteadyClock()


@pytest.fixture
def metronome(now: SteadyClock) -> Metronome:
    """Of a flight of six steps that is about to start."""
    metronome = Metronome(
        (LEADER, CONTROLLER, RECORDER),
        observers=(RECORDER,),
        configuration="",
        n_steps=6,
        period=0.05,
        start_timeout=60.0,
        step_timeout=2.0,
        now=now,
        world=(LEADER,),
        controllers=(CONTROLLER,),
        replaceable=(CONTROLLER, RECORDER),
    )
    finish(metronome, LEADER, CONTROLLER, RECORDER)
    return metronome


def finish(metronome: Metronome, *nodes: str, step: int | None = None, fault: str = "") -> None:
    for node in nodes:
        metronome.add(Done(node, metronome.step if step is None else step, (), fault))


def missed(metronome: Metronome) -> dict[str, object]:
    return {
        node: metronome.report()[f"real_time.missed_steps.{node}"] for node in (LEADER, CONTROLLER, RECORDER)
    }


def test_steps_begin_one_period_after_the_other_without_drift(metronome: Metronome, now: SteadyClock) -> None:
    assert metronome.complete()
    assert metronome.advance() == 0
    for step in (1, 2, 3):
        due = 1234.5 + step * 0.05
        assert metronome.due() == pytest.approx(due, abs=1e-9)
        now.time = due - 0.001
        finish(metronome, LEADER, CONTROLLER, RECORDER)
        assert not metronome.complete(), "all have finished, but the period is not over"
        now.time = due + 0.02  # the clock itself is late
        assert metronome.complete()
        assert metronome.advance() == step
    assert set(missed(metronome).values()) == {0}


def test_unfinished_steps_are_counted_and_stop_nothing(metronome: Metronome, now: SteadyClock) -> None:
    metronome.advance()
    for _ in range(3):
        finish(metronome, LEADER)
        now.time += 0.051
        assert metronome.complete()
        metronome.advance()
    # The recorder may be one step behind.
    assert missed(metronome) == {LEADER: 0, CONTROLLER: 3, RECORDER: 2}
    finish(metronome, CONTROLLER, RECORDER, step=3)  # they have left out three steps
    finish(metronome, LEADER)
    now.time += 0.051
    metronome.advance()
    assert missed(metronome) == {LEADER: 0, CONTROLLER: 3, RECORDER: 2}


def test_the_last_step_waits_for_all(metronome: Metronome, now: SteadyClock) -> None:
    metronome.advance()
    for _ in range(6):
        finish(metronome, LEADER, CONTROLLER)
        now.time += 0.051
        metronome.advance()
    finish(metronome, LEADER, CONTROLLER)
    now.time += 1.0
    assert not metronome.complete()
    finish(metronome, RECORDER)
    assert metronome.complete()


def fly_on(metronome: Metronome, now: SteadyClock, *nodes: str, duration: float = 0.5) -> None:
    """These nodes finish the present step, which takes longer than usual, and the next one begins."""
    finish(metronome, *nodes)
    now.time += duration
    assert metronome.complete()
    metronome.advance()


def test_a_vehicle_that_stays_silent_is_named(metronome: Metronome, now: SteadyClock) -> None:
    metronome.advance()
    finish(metronome, CONTROLLER, RECORDER)
    now.time += 2.1
    message = r"step 0 \(0.00 s\) not finished within 2 s .*: /leader/quadrotor$"
    with pytest.raises(SilentNodeError, match=message):
        metronome.complete()


def test_controllers_and_observers_may_be_silent_while_a_vehicle_is_in_the_air(
    metronome: Metronome, now: SteadyClock
) -> None:
    metronome.advance()
    for _ in range(5):
        fly_on(metronome, now, LEADER)
    metronome.add(Done(LEADER, 5, (), "", rests=True))
    message = (
        r"step 5 \(0.25 s\): all vehicles are on the ground, and nothing was heard for 2 s "
        r"\(lockstep.step_timeout_s\) from: /formation/controller$"
    )
    with pytest.raises(SilentNodeError, match=message):
        metronome.complete()


def test_a_team_on_the_ground_waits_for_a_controller_that_is_late(
    metronome: Metronome, now: SteadyClock
) -> None:
    metronome.advance()
    for step in range(4):
        metronome.add(Done(LEADER, step, (), "", rests=True))
        finish(metronome, RECORDER)
        now.time += 0.45
        assert metronome.complete()
        metronome.advance()
    finish(metronome, CONTROLLER, LEADER)
    now.time += 1.0
    assert metronome.complete()


def test_nobody_waits_at_the_end_for_those_that_were_lost(metronome: Metronome, now: SteadyClock) -> None:
    metronome.advance()
    for _ in range(6):
        fly_on(metronome, now, LEADER, RECORDER)
    finish(metronome, LEADER, RECORDER)
    with pytest.raises(SilentNodeError, match=r"step 6 .*: /formation/controller$"):
        metronome.complete()


def test_a_controller_that_was_started_again_goes_on_with_the_present_step(
    metronome: Metronome, now: SteadyClock
) -> None:
    metronome.advance()
    fly_on(metronome, now, LEADER, CONTROLLER, RECORDER, duration=0.05)
    with pytest.raises(RejectionError):
        metronome.add(Done(CONTROLLER, JOINED, (), "", process=42))
    finish(metronome, LEADER)
    now.time += 0.3
    metronome.complete()
    assert metronome.take_changes() == []
    now.time += 0.3
    metronome.complete()
    (change,) = metronome.take_changes()
    assert (change.verdict, change.node, change.process) == (Verdict.ADMITTED, CONTROLLER, 42)
    assert metronome.report()["members.admitted"] == 1
    metronome.advance()
    finish(metronome, CONTROLLER)


def test_a_clock_that_was_stopped_blames_nobody(metronome: Metronome, now: SteadyClock) -> None:
    metronome.advance()
    finish(metronome, LEADER, CONTROLLER, RECORDER)
    now.time += 30.0
    assert metronome.complete()
    metronome.advance()
    assert metronome.complete(), "the steps of the past begin at once"


def test_steps_are_held_back_while_the_world_is_late(metronome: Metronome, now: SteadyClock) -> None:
    metronome.advance()
    now.time = 1234.56
    assert metronome.complete(), "the leader may be late by one step"
    metronome.advance()
    now.time = 1234.61
    assert not metronome.complete()
    now.time = 1234.63
    finish(metronome, LEADER, step=0)
    assert metronome.complete()
    assert metronome.advance() == 2
    assert metronome.report()["real_time.held_s"] == pytest.approx(0.03, abs=1e-9)
    assert metronome.due() == pytest.approx(1234.68, abs=1e-9), "and all that follow"
    finish(metronome, LEADER, step=1)
    finish(metronome, LEADER, step=2)
    now.time = 1234.69
    assert metronome.complete()
    metronome.advance()
    assert metronome.due() == pytest.approx(1234.73, abs=1e-9), "the clock was late, and makes up for it"


def test_after_a_fault_the_others_finish_the_step(metronome: Metronome, now: SteadyClock) -> None:
    metronome.advance()
    finish(metronome, LEADER, fault="on the ground")
    finish(metronome, CONTROLLER)
    now.time += 1.0
    assert not metronome.complete()
    finish(metronome, RECORDER)
    assert metronome.complete()
    with pytest.raises(VehicleFaultError, match=r"/leader/quadrotor in step 0 \(0.00 s\): on the ground"):
        metronome.advance()


def test_a_step_that_is_to_come_cannot_be_finished(metronome: Metronome) -> None:
    metronome.advance()
    with pytest.raises(RejectionError) as rejected:
        finish(metronome, LEADER, step=1)
    assert rejected.value.reason is Reason.EARLY


def test_the_time_of_a_flight_follows_the_fastest_tick(now: SteadyClock) -> None:
    flight = FlightTime(PERIOD_NS, now.ns)
    assert flight.now_ns() == 0
    now.time = 100.003
    flight.tick(0)
    now.time = 100.051
    flight.tick(1)
    assert flight.now_ns() == PERIOD_NS
    now.time = 100.120
    flight.tick(2)
    assert flight.now_ns() == 119 * MS, "this tick is 19 ms slower than the one before"
    assert flight.steady(2 * PERIOD_NS) == pytest.approx(100.101, abs=1e-9)


def test_the_time_of_a_flight_follows_a_clock_that_held_a_step_back(now: SteadyClock) -> None:
    flight = FlightTime(PERIOD_NS, now.ns)
    for step in range(20):
        now.time = 7.0 + step * 0.05 + (0.07 if step >= 10 else 0.0)
        flight.tick(step)
        if step == 12:
            assert flight.now_ns() == 12 * PERIOD_NS + 70 * MS, "three late ticks may be late on their way"
    assert flight.now_ns() == 19 * PERIOD_NS


def test_the_time_of_a_flight_follows_a_clock_that_goes_differently(now: SteadyClock) -> None:
    flight = FlightTime(PERIOD_NS, now.ns)
    for step in range(1000):
        now.time = 7.0 + step * 0.05 * (1.0 + 50e-6)
        flight.tick(step)
    assert flight.now_ns() == pytest.approx(999 * PERIOD_NS, abs=0.2 * MS)


def test_ages() -> None:
    ages = Ages()
    assert ages.report("age")["age_median_ms"] == 0.0
    for age_ns in [*range(MS, 100 * MS, MS), 5000 * MS, -MS]:
        ages.add(age_ns)
    assert ages.report("command") == {
        "command_median_ms": 50.05,
        "command_99_percent_ms": 99.05,
        "command_most_ms": 5000.0,
    }


def arrivals() -> Arrivals:
    kept = Arrivals([LEADER, CONTROLLER], {COMMAND: PERIOD_NS}, PERIOD_NS)
    kept.open(IMU)
    kept.open(COMMAND)
    return kept


def test_a_step_is_complete_when_all_that_was_sent_has_arrived() -> None:
    kept = arrivals()
    kept.report(Done(LEADER, READY, (), ""), 0)
    kept.report(Done(LEADER, 3, ((IMU, 150 * MS), ("/unread", 150 * MS)), ""), 150 * MS)
    assert not kept.complete(3), "the controller has not finished"
    kept.report(Done(CONTROLLER, 3, (), ""), 158 * MS)
    assert not kept.complete(3), "the message is still on its way"
    kept.add(IMU, Arrived(150 * MS, 158 * MS, "imu"))
    assert kept.complete(3)
    assert not kept.complete(4)
    kept.report(Done(LEADER, 5, ((IMU, 250 * MS),), "lost"), 255 * MS)
    kept.report(Done(CONTROLLER, 5, (), ""), 255 * MS)
    assert kept.complete(4), "they have left out step 4"
    assert kept.faulty


def test_messages_wait_for_their_step() -> None:
    kept = arrivals()
    for stamp_ms, arrival_ms in ((100, 130), (150, 151), (150, 199), (200, 199)):
        kept.add(IMU, Arrived(stamp_ms * MS, arrival_ms * MS, (stamp_ms, arrival_ms)))
    kept.add(COMMAND, Arrived(200 * MS, 160 * MS, "command"))  # for the interval after the next

    def taken(newest_ms: int | None, end_ms: int | None) -> dict[str, list[object]]:
        newest_ns = None if newest_ms is None else newest_ms * MS
        end_ns = None if end_ms is None else end_ms * MS
        found = kept.take([IMU, COMMAND], newest_ns, end_ns)
        return {topic: [arrived.message for arrived in each] for topic, each in found.items()}

    assert taken(150, 170) == {IMU: [(100, 130), (150, 151)], COMMAND: ["command"]}
    assert taken(150, None) == {IMU: [(150, 199)]}, "what is stamped 200 ms cannot be used at 150 ms"
    assert taken(150, 250) == {}
    assert taken(None, None) == {IMU: [(200, 199)]}


@pytest.mark.parametrize(
    ("done", "reason"),
    [
        (Done(RECORDER, 0, (), ""), Reason.FOREIGN),
        (Done(LEADER, 2, (), ""), Reason.STALE),
        (Done(LEADER, 1, (), ""), Reason.STALE),
        (Done(LEADER, 23, (), ""), Reason.EARLY),
    ],
)
def test_unusable_reports_are_refused(done: Done, reason: Reason) -> None:
    kept = arrivals()
    kept.report(Done(LEADER, 2, (), ""), 101 * MS)
    with pytest.raises(RejectionError) as rejected:
        kept.report(done, 102 * MS)
    assert rejected.value.reason is reason


def test_a_node_that_hears_the_clock_late_loses_no_message() -> None:
    """A recorder on a busy machine took the messages of 0.3 s before it heard the ticks of that time."""
    kept = arrivals()
    kept.report(Done(LEADER, 9, (), ""), 100 * MS)
    kept.open(IMU, is_single=True)
    kept.add(IMU, Arrived(450 * MS, 100 * MS, "imu"))
    assert [arrived.message for arrived in kept.take([IMU], None, None)[IMU]] == ["imu"]


@pytest.mark.parametrize(
    ("stamp_ms", "arrival_ms", "reason"),
    [
        (151, 160, Reason.INVALID),
        (1_200, 160, Reason.EARLY),
        (150, 160, Reason.DUPLICATE),
        (150, 5_200, Reason.STALE),
    ],
)
def test_unusable_messages_are_refused(stamp_ms: int, arrival_ms: int, reason: Reason) -> None:
    kept = Arrivals([LEADER], {}, PERIOD_NS)
    kept.open(IMU, is_single=True)
    kept.add(IMU, Arrived(150 * MS, 152 * MS, "imu"))
    with pytest.raises(RejectionError) as rejected:
        kept.add(IMU, Arrived(stamp_ms * MS, arrival_ms * MS, "another"))
    assert rejected.value.reason is reason
    taken = kept.take([IMU], None, None)
    assert [arrived.message for arrived in taken[IMU]] == ["imu"]
