"""The kinds of cases: what is done to a flight, and what must hold. docs/reliability.md shows this table."""

from collections.abc import Callable
from dataclasses import dataclass

from relform_bringup.faults import checks, draws, judges
from relform_bringup.faults.evidence import Evidence
from relform_bringup.faults.plan import CLOCK, CONTROLLER, FLY, RECORDER, VEHICLE, Action, Draw, Plan


@dataclass(frozen=True)
class Kind:
    """One kind of cases."""

    name: str
    done: str
    """What is done to the flight, in words."""
    must: str
    """What must hold, in words, beside what must hold in every case."""
    draw: Callable[[Draw], Plan]
    judge: judges.Judge


def problems(kind: Kind, plan: Plan, evidence: Evidence) -> tuple[str, ...]:
    """What does not hold, a line each; empty: the case has passed."""
    always = (*checks.all_ended(evidence), *checks.has_bag(evidence))
    return (*always, *kind.judge(plan, evidence))


KINDS = {
    kind.name: kind
    for kind in (
        Kind(
            "kill-vehicle",
            "a vehicle is killed",
            "the flight ends, the clock names the vehicle",
            draws.kill(VEHICLE),
            judges.kill_vehicle,
        ),
        Kind(
            "kill-clock",
            "the clock is killed",
            "all nodes end by themselves and name the clock",
            draws.kill(CLOCK),
            judges.over(0, ""),
        ),
        Kind(
            "kill-fly",
            "`fly` is killed",
            "all its processes end; the recorder closes the bag",
            draws.kill(FLY),
            judges.kill_fly,
        ),
        Kind(
            "interrupt-fly",
            "`fly` gets SIGINT",
            "it ends with this reason and exit code 130, and all its processes end",
            draws.kill(FLY, Action.INTERRUPT),
            judges.interrupt_fly,
        ),
        Kind(
            "stop-controller",
            "the controller is stopped for up to 1.8 s, then continued",
            "vehicles fly their plan, then sink; the controller takes the team back into formation",
            draws.stop(CONTROLLER, 1.8),
            judges.stop,
        ),
        Kind(
            "stop-vehicle",
            "a vehicle is stopped for up to 2 s, then continued",
            "the flight is held back meanwhile, and flown to its end",
            draws.stop(VEHICLE, 2.0),
            judges.stop,
        ),
        Kind(
            "stop-recorder",
            "the recorder is stopped for up to 2 s, then continued",
            "undisturbed; every message is in the bag",
            draws.stop(RECORDER, 2.0),
            judges.undisturbed,
        ),
        Kind(
            "stop-clock",
            "the clock is stopped for up to 2 s, then continued",
            "the flight is held back meanwhile, and flown to its end",
            draws.stop(CLOCK, 2.0),
            judges.stop,
        ),
        Kind(
            "stop-fly",
            "`fly` is stopped for up to 2 s, then continued",
            "undisturbed; `fly` reports it",
            draws.stop(FLY, 2.0),
            judges.undisturbed,
        ),
        Kind(
            "restart-fly",
            "`fly` is killed, and started again within 1 s",
            "the processes of the first one end; the second flight is undisturbed",
            draws.restart(FLY, draws.SHORT, 1.0),
            judges.undisturbed,
        ),
        Kind(
            "late-joiner",
            "a viewer joins in flight, and leaves",
            "undisturbed",
            draws.late_joiner,
            judges.undisturbed,
        ),
        Kind(
            "foreign",
            "a foreign node sends altered copies of the messages of a vehicle, some a second early or late",
            "undisturbed; nodes count what they reject",
            draws.foreign(1),
            judges.foreign,
        ),
        Kind(
            "flood",
            "the same with ten copies of each message",
            "undisturbed; nodes count what they reject",
            draws.foreign(10),
            judges.foreign,
        ),
        Kind(
            "full-disk",
            "the disk of the bag becomes full",
            "the recorder reports it, the clock ends the flight with this reason",
            draws.full_disk,
            judges.full_disk,
        ),
        Kind(
            "slow-disk",
            "every write to a file takes 0.02 to 0.6 s",
            "undisturbed; every message is in the bag",
            draws.slow_disk,
            judges.undisturbed,
        ),
        Kind(
            "clock-jump",
            "the clock of the machine jumps by up to a day, twice",
            "undisturbed",
            draws.clock_jump,
            judges.undisturbed,
        ),
        Kind(
            "core-taken",
            "all nodes get one core, which another process keeps busy",
            "the flight is flown to its end in formation",
            draws.core_taken,
            judges.undisturbed,
        ),
        Kind(
            "late-discovery",
            "a node starts up to 5 s after the others",
            "the flight begins when it is there, and is undisturbed",
            draws.late_discovery,
            judges.undisturbed,
        ),
    )
}
"""By name."""
