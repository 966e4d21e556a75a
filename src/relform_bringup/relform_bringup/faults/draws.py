"""What is done to a flight, by the kind of its case: each function here draws the plan of one kind."""

from collections.abc import Callable, Sequence

from relform_bringup.faults.plan import (
    CLOCK,
    CONTROLLER,
    FLY,
    MOTIONS,
    NODES,
    RECORDER,
    VEHICLE,
    VEHICLES,
    VIEWER,
    Action,
    Draw,
    Fault,
    Plan,
)

SHORT, MEDIUM, LONG = 4.5, 6.0, 11.0
"""Lengths of flights [s]."""
GROUND_S = 22.0
"""Length of a flight from the ground and back, with time for another controller to land the team [s]."""
GROUND = (
    "ground={climb_speed_m_s: 0.8, descent_speed_m_s: 0.5, interval_s: 0.5, landing: together, "
    f"time_s: {GROUND_S}}}"
)
STEADY = ("hover", "line")
"""Motions from which vehicles that were without a controller find back into formation soon."""


def _who(case: Draw, target: str) -> str:
    """A target; VEHICLE stands for any of them."""
    return case.one_of(*VEHICLES) if target == VEHICLE else target


def stop(target: str, longest: float) -> Callable[[Draw], Plan]:
    def draw(case: Draw) -> Plan:
        at, time, who = case.between(0.5, 2.0), case.between(0.1, longest), _who(case, target)
        faults = (Fault(at, Action.STOP, who), Fault(at + time, Action.CONTINUE, who))
        order = (FLY,) if target == FLY else case.order(*NODES)
        return Plan(case.flight(MEDIUM), MEDIUM, faults, order)

    return draw


def kill(target: str, action: Action = Action.KILL) -> Callable[[Draw], Plan]:
    """The flight ends by it."""

    def draw(case: Draw) -> Plan:
        order = (FLY,) if target == FLY else case.order(*NODES)
        faults = (Fault(case.between(0.3, 3.0), action, _who(case, target)),)
        return Plan(case.flight(60.0), 60.0, faults, order, is_ended_by_fault=True)

    return draw


def kill_observer(case: Draw) -> Plan:
    faults = (Fault(case.between(0.5, 2.5), Action.KILL, RECORDER),)
    return Plan(case.flight(MEDIUM), MEDIUM, faults, case.order(*NODES))


def restart(
    target: str, duration: float, longest: float, motions: Sequence[str] = tuple(MOTIONS)
) -> Callable[[Draw], Plan]:
    def draw(case: Draw) -> Plan:
        at, time, who = case.between(0.5, 2.5), case.between(0.0, longest), _who(case, target)
        faults = (Fault(at, Action.KILL, who), Fault(at + time, Action.START, who))
        order = (FLY,) if target == FLY else case.order(*NODES)
        return Plan(case.flight(duration, motions, sinks_slowly=True), duration, faults, order)

    return draw


def restart_from_ground(case: Draw) -> Plan:
    """The controller is lost while the team takes off, flies or lands."""
    at, time = case.between(1.0, 9.0), case.between(0.0, 1.5)
    faults = (Fault(at, Action.KILL, CONTROLLER), Fault(at + time, Action.START, CONTROLLER))
    overrides = (*case.flight(3.0, STEADY, sinks_slowly=True), GROUND)
    return Plan(overrides, GROUND_S, faults, case.order(*NODES))


def second(target: str) -> Callable[[Draw], Plan]:
    def draw(case: Draw) -> Plan:
        faults = (Fault(case.between(0.2, 1.5), Action.START, _who(case, target)),)
        return Plan(case.flight(MEDIUM), MEDIUM, faults, case.order(*NODES))

    return draw


def kill_in_fly(case: Draw) -> Plan:
    who = case.one_of(case.one_of(*VEHICLES), CONTROLLER, CLOCK, RECORDER)
    faults = (Fault(case.between(0.5, 2.5), Action.KILL, f"{FLY}:{who}"),)
    return Plan(case.flight(LONG, STEADY, sinks_slowly=True), LONG, faults, (FLY,))


def late_joiner(case: Draw) -> Plan:
    at = case.between(0.2, 2.5)
    faults = (Fault(at, Action.START, VIEWER), Fault(SHORT - 0.5, Action.INTERRUPT, VIEWER))
    return Plan(case.flight(SHORT), SHORT, faults, case.order(*NODES))


def foreign(copies: int) -> Callable[[Draw], Plan]:
    def draw(case: Draw) -> Plan:
        time, who = case.between(0.5, 2.0), case.one_of(*VEHICLES)
        faults = (Fault(case.between(0.5, 2.0), Action.FOREIGN, who, time, copies),)
        return Plan(case.flight(SHORT), SHORT, faults, case.order(*NODES))

    return draw


def full_disk(case: Draw) -> Plan:
    size = int(case.between(6e5, 1.5e6))
    return Plan(case.flight(60.0), 60.0, (), case.order(*NODES), disk_bytes=size)


def slow_disk(case: Draw) -> Plan:
    faults = (Fault(case.between(0.2, 2.0), Action.SLOW_DISK, "all", case.between(0.02, 0.6)),)
    return Plan(case.flight(SHORT), SHORT, faults, case.order(*NODES))


def clock_jump(case: Draw) -> Plan:
    at = case.between(0.2, 1.5)
    there, back = (case.between(-1.0, 1.0) * 10.0 ** case.between(0.0, 5.0) for _ in range(2))
    faults = (
        Fault(at, Action.JUMP_CLOCK, "all", there),
        Fault(at + case.between(0.5, 2.0), Action.JUMP_CLOCK, "all", back),
    )
    return Plan(case.flight(SHORT), SHORT, faults, case.order(*NODES))


def core_taken(case: Draw) -> Plan:
    at, time = case.between(0.2, 2.0), case.between(0.5, 2.0)
    faults = (Fault(at, Action.PIN, "all", time), Fault(at + time, Action.UNPIN, "all"))
    return Plan(case.flight(SHORT), SHORT, faults, case.order(*NODES))


def late_discovery(case: Draw) -> Plan:
    order = case.order(*NODES)
    late = {case.one_of(*NODES): case.between(1.0, 5.0)}
    return Plan(case.flight(2.0), 2.0, (), order, late)
