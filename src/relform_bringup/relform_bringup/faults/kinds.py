"""The kinds of cases: what is done to a flight, and what must hold. docs/reliability.md shows this table."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from relform_bringup.faults import checks
from relform_bringup.faults.evidence import Evidence
from relform_bringup.faults.plan import (
    CLOCK,
    CONTROLLER,
    FLY,
    NODES,
    RECORDER,
    VEHICLES,
    VIEWER,
    Action,
    Draw,
    Fault,
    Plan,
)

OVER = "the flight is over"
SHORT, MEDIUM = 5.0, 6.5
"""Lengths of flights [s]."""

Expected = Mapping[str, tuple[int, str]]


@dataclass(frozen=True)
class Kind:
    """One kind of cases."""

    name: str
    done: str
    """What is done to the flight, in words."""
    must: str
    """What must hold, in words, beside what must hold in every case."""
    draw: Callable[[Draw], Plan]
    judge: Callable[[Plan, Evidence], Iterator[str]]


def problems(kind: Kind, plan: Plan, evidence: Evidence) -> tuple[str, ...]:
    """What does not hold, a line each; empty: the case has passed."""
    always = (*checks.all_ended(evidence), *checks.has_bag(evidence))
    return (*always, *kind.judge(plan, evidence))


def _stop(target: str, longest: float) -> Callable[[Draw], Plan]:
    def draw(case: Draw) -> Plan:
        at, time = case.between(0.5, 2.0), case.between(0.1, longest)
        who = case.one_of(*VEHICLES) if target in VEHICLES else target
        faults = (Fault(at, Action.STOP, who), Fault(at + time, Action.CONTINUE, who))
        order = (FLY,) if target == FLY else case.order(*NODES)
        return Plan(case.flight(MEDIUM), MEDIUM, faults, order)

    return draw


def _judge_stop(plan: Plan, evidence: Evidence) -> Iterator[str]:
    yield from checks.exits(evidence)
    yield from checks.undisturbed(plan, evidence, gap=plan.disturbed)


def _kill(target: str) -> Callable[[Draw], Plan]:
    def draw(case: Draw) -> Plan:
        who = case.one_of(*VEHICLES) if target in VEHICLES else target
        order = (FLY,) if target == FLY else case.order(*NODES)
        faults = (Fault(case.between(0.2, 3.0), Action.KILL, who),)
        return Plan(case.flight(60.0), 60.0, faults, order, is_ended_by_fault=True)

    return draw


def _judge_kill_clock(plan: Plan, evidence: Evidence) -> Iterator[str]:
    reason = (1, "/sim/clock has gone in step")
    yield from checks.exits(evidence, dict.fromkeys((*VEHICLES, CONTROLLER, RECORDER), reason))
    yield from checks.in_the_air(evidence)


def _judge_kill_fly(plan: Plan, evidence: Evidence) -> Iterator[str]:
    yield from checks.in_the_air(evidence)


def _late_joiner(case: Draw) -> Plan:
    at = case.between(0.2, 2.5)
    faults = (Fault(at, Action.START, VIEWER), Fault(SHORT - 0.5, Action.INTERRUPT, VIEWER))
    return Plan(case.flight(SHORT), SHORT, faults, case.order(*NODES))


def _judge_late_joiner(plan: Plan, evidence: Evidence) -> Iterator[str]:
    yield from checks.exits(evidence)
    yield from checks.undisturbed(plan, evidence)


def _slow_disk(case: Draw) -> Plan:
    faults = (Fault(case.between(0.2, 2.0), Action.SLOW_DISK, "all", case.between(0.02, 0.6)),)
    return Plan(case.flight(SHORT), SHORT, faults, case.order(*NODES))


def _clock_jump(case: Draw) -> Plan:
    at = case.between(0.2, 1.5)
    there, back = (case.between(-1.0, 1.0) * 10.0 ** case.between(0.0, 5.0) for _ in range(2))
    faults = (
        Fault(at, Action.JUMP_CLOCK, "all", there),
        Fault(at + case.between(0.5, 2.0), Action.JUMP_CLOCK, "all", back),
    )
    return Plan(case.flight(SHORT), SHORT, faults, case.order(*NODES))


def _core_taken(case: Draw) -> Plan:
    at, time = case.between(0.2, 2.0), case.between(0.5, 2.0)
    faults = (Fault(at, Action.PIN, "all", time), Fault(at + time, Action.UNPIN, "all"))
    return Plan(case.flight(SHORT), SHORT, faults, case.order(*NODES))


def _judge_undisturbed(plan: Plan, evidence: Evidence) -> Iterator[str]:
    yield from checks.exits(evidence)
    yield from checks.undisturbed(plan, evidence)


def _late_discovery(case: Draw) -> Plan:
    order = case.order(*NODES)
    late = {case.one_of(*NODES): case.between(1.0, 5.0)}
    return Plan(case.flight(2.0), 2.0, (), order, late)


def _full_disk(case: Draw) -> Plan:
    return Plan(case.flight(60.0), 60.0, (), case.order(*NODES), disk_bytes=int(case.between(6e5, 1.5e6)))


def _judge_full_disk(plan: Plan, evidence: Evidence) -> Iterator[str]:
    reason = "No space left on device"
    expected: Expected = {
        CLOCK: (3, reason),
        RECORDER: (1, reason),
        **dict.fromkeys((*VEHICLES, CONTROLLER), (1, "has gone in step")),
    }
    yield from checks.exits(evidence, expected)
    yield from checks.in_the_air(evidence)


KINDS = {
    kind.name: kind
    for kind in (
        Kind(
            "stop-controller",
            "the controller is stopped for up to 1.8 s, then continued",
            "vehicles fly their plan, then sink; the controller takes the team back into formation",
            _stop(CONTROLLER, 1.8),
            _judge_stop,
        ),
        Kind(
            "stop-vehicle",
            "a vehicle is stopped for up to 2 s, then continued",
            "the flight is held back meanwhile, and flown to its end",
            _stop(VEHICLES[0], 2.0),
            _judge_stop,
        ),
        Kind(
            "stop-recorder",
            "the recorder is stopped for up to 2 s, then continued",
            "the flight goes on; every message is in the bag",
            _stop(RECORDER, 2.0),
            _judge_undisturbed,
        ),
        Kind(
            "stop-clock",
            "the clock is stopped for up to 2 s, then continued",
            "the flight is held back meanwhile, and flown to its end",
            _stop(CLOCK, 2.0),
            _judge_stop,
        ),
        Kind(
            "stop-fly",
            "`fly` is stopped for up to 2 s, then continued",
            "the flight goes on; `fly` reports it",
            _stop(FLY, 2.0),
            _judge_undisturbed,
        ),
        Kind(
            "kill-clock",
            "the clock is killed",
            "all nodes end by themselves and name the clock",
            _kill(CLOCK),
            _judge_kill_clock,
        ),
        Kind(
            "kill-fly",
            "`fly` is killed",
            "all its processes end; the recorder closes the bag",
            _kill(FLY),
            _judge_kill_fly,
        ),
        Kind(
            "late-joiner",
            "a viewer joins in flight, and leaves",
            "the flight is undisturbed",
            _late_joiner,
            _judge_late_joiner,
        ),
        Kind(
            "full-disk",
            "the disk of the bag becomes full",
            "the recorder reports it, the clock ends the flight with this reason",
            _full_disk,
            _judge_full_disk,
        ),
        Kind(
            "slow-disk",
            "every write to a file takes 0.02 to 0.6 s",
            "the flight is undisturbed; every message is in the bag",
            _slow_disk,
            _judge_undisturbed,
        ),
        Kind(
            "clock-jump",
            "the clock of the machine jumps by up to a day, twice",
            "the flight is undisturbed",
            _clock_jump,
            _judge_undisturbed,
        ),
        Kind(
            "core-taken",
            "all nodes get one core, which another process keeps busy",
            "the flight is flown to its end in formation",
            _core_taken,
            _judge_undisturbed,
        ),
        Kind(
            "late-discovery",
            "a node starts up to 5 s after the others",
            "the flight begins when it is there, and is undisturbed",
            _late_discovery,
            _judge_undisturbed,
        ),
    )
}
"""By name."""
