"""What must hold, by the kind of a case: each function here gives a line for each thing that does not."""

from collections.abc import Callable, Iterator

from relform_bringup.faults import checks
from relform_bringup.faults.evidence import Evidence
from relform_bringup.faults.plan import CLOCK, CONTROLLER, FLY, RECORDER, VEHICLES, Plan

CLOCK_GONE = "/sim/clock has gone in step"
REFUSED = "refused in step"

Node = tuple[str, tuple[int, str]]
"""Name of a process, its exit code, and a pattern of its last line."""
Judge = Callable[[Plan, Evidence], Iterator[str]]


def undisturbed(plan: Plan, evidence: Evidence) -> Iterator[str]:
    yield from checks.exits(evidence)
    yield from checks.undisturbed(plan, evidence)


def foreign(plan: Plan, evidence: Evidence) -> Iterator[str]:
    yield from undisturbed(plan, evidence)
    yield from checks.counted(evidence)


def stop(plan: Plan, evidence: Evidence) -> Iterator[str]:
    yield from checks.exits(evidence)
    yield from checks.undisturbed(plan, evidence, gap=plan.disturbed)


def over(code: int, reason: str, *also: Node) -> Judge:
    """The clock ends the flight with a code and a reason, and the other nodes end with it."""

    def judge(plan: Plan, evidence: Evidence) -> Iterator[str]:
        nodes = dict.fromkeys((*VEHICLES, CONTROLLER, RECORDER), (1, CLOCK_GONE))
        yield from checks.exits(evidence, {**nodes, CLOCK: (code, reason), **dict(also)})
        yield from checks.in_the_air(evidence)

    return judge


def kill_controller(plan: Plan, evidence: Evidence) -> Iterator[str]:
    yield from over(2, "all vehicles are on the ground")(plan, evidence)
    yield from checks.landed(evidence)


def kill_vehicle(plan: Plan, evidence: Evidence) -> Iterator[str]:
    who = plan.faults[0].target
    again = (f"{who}_1", (1, REFUSED))
    yield from over(2, f"not finished within .*: /{who}/quadrotor$", again)(plan, evidence)


def kill_recorder(plan: Plan, evidence: Evidence) -> Iterator[str]:
    yield from checks.exits(evidence, {CLOCK: (2, "not finished within .*: /recorder$")})
    yield from checks.in_the_air(evidence)
    yield from checks.reaches_end(plan, evidence)


def kill_fly(plan: Plan, evidence: Evidence) -> Iterator[str]:
    yield from checks.in_the_air(evidence)


def interrupt_fly(plan: Plan, evidence: Evidence) -> Iterator[str]:
    yield from checks.exits(evidence, {FLY: (130, "interrupted by SIGINT")})
    yield from checks.in_the_air(evidence)


def kill_in_fly(plan: Plan, evidence: Evidence) -> Iterator[str]:
    *_, who = plan.faults[0].target.partition(":")
    node = f"/{who}/quadrotor" if who in VEHICLES else {CLOCK: "/sim/clock"}.get(who, f"/{who}")
    if who == CONTROLLER:
        yield from checks.exits(evidence)
        yield from checks.complete(plan, evidence)
        yield from checks.in_formation(evidence)
    else:
        yield from checks.exits(evidence, {FLY: (1, f"error: {node} was killed by SIGKILL")})
    yield from checks.in_the_air(evidence)


def restart_controller(plan: Plan, evidence: Evidence) -> Iterator[str]:
    yield from checks.in_the_air(evidence)
    if checks.came_late(evidence):  # then the vehicles land, as without one
        return
    yield from checks.exits(evidence)
    yield from checks.complete(plan, evidence)
    yield from checks.taken_over(plan, evidence)
    yield from checks.in_formation(evidence)


def restart_from_ground(plan: Plan, evidence: Evidence) -> Iterator[str]:
    yield from checks.in_the_air(evidence)
    if not checks.came_late(evidence):  # else there may be no time left to land
        yield from checks.landed(evidence)
        yield from checks.exits(evidence)
        yield from checks.complete(plan, evidence)


def restart_recorder(plan: Plan, evidence: Evidence) -> Iterator[str]:
    yield from checks.in_the_air(evidence)
    yield from checks.reaches_end(plan, evidence)
    if checks.came_late(evidence):
        return
    yield from checks.exits(evidence)
    yield from checks.in_formation(evidence)


def second(plan: Plan, evidence: Evidence) -> Iterator[str]:
    yield from checks.exits(evidence, {f"{plan.faults[0].target}_1": (1, REFUSED)})
    yield from checks.undisturbed(plan, evidence)


def full_disk(plan: Plan, evidence: Evidence) -> Iterator[str]:
    reason = "No space left on device"
    yield from over(3, reason, (RECORDER, (1, reason)))(plan, evidence)
