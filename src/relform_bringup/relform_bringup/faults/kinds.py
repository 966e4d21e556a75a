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
            "kill-controller",
            "the controller is killed",
            "they finish their plan, sink, and stand on the ground, level; then the clock ends the flight",
            draws.kill(CONTROLLER),
            judges.kill_controller,
        ),
        Kind(
            "kill-vehicle",
            "a vehicle is killed",
            "the flight ends, the clock names the vehicle",
            draws.kill(VEHICLE),
            judges.kill_vehicle,
        ),
        Kind(
            "kill-recorder",
            "the recorder is killed",
            "the flight is flown to its end, where the clock names the recorder; the bag can be recovered",
            draws.kill_observer,
            judges.kill_recorder,
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
            "kill-in-fly",
            "one of the nodes that `fly` has started is killed",
            "`fly` starts a controller again, which takes over; for any other node it ends with the reason",
            draws.kill_in_fly,
            judges.kill_in_fly,
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
            "restart-controller",
            "the controller is killed, and another one started within 1.5 s",
            "within 2 s of its admission by the clock it commands the team, which ends in formation",
            draws.restart(CONTROLLER, draws.LONG, 1.5, draws.STEADY),
            judges.restart_controller,
        ),
        Kind(
            "restart-from-ground",
            "the same in a flight that takes off and lands, at any time of it",
            "no vehicle crashes, and all stand on the ground at the end, level",
            draws.restart_from_ground,
            judges.restart_from_ground,
        ),
        Kind(
            "restart-vehicle",
            "a vehicle is killed, and started again within 1 s",
            "the new process is refused; the flight ends, the clock names the vehicle",
            draws.restart(VEHICLE, draws.LONG, 1.0),
            judges.kill_vehicle,
        ),
        Kind(
            "restart-clock",
            "the clock is killed, and another one started within 1 s",
            "it finds that nobody takes part in another flight and ends; all nodes end and name the clock",
            draws.restart(CLOCK, draws.SHORT, 1.0),
            judges.over(0, "", (f"{CLOCK}_1", (2, "not finished within|not ready within"))),
        ),
        Kind(
            "restart-recorder",
            "the recorder is killed, and another one started within 1 s",
            "it is admitted; the flight is flown to its end in formation; both bags are readable",
            draws.restart(RECORDER, draws.MEDIUM, 1.0),
            judges.restart_recorder,
        ),
        Kind(
            "restart-fly",
            "`fly` is killed, and started again within 1 s",
            "the processes of the first one end; the second flight is undisturbed",
            draws.restart(FLY, draws.SHORT, 1.0),
            judges.undisturbed,
        ),
        Kind(
            "second-controller",
            "a second controller is started",
            "it is refused; the flight is undisturbed",
            draws.second(CONTROLLER),
            judges.second,
        ),
        Kind(
            "same-vehicle",
            "a second process with the name of a vehicle is started",
            "it is refused; the flight is undisturbed",
            draws.second(VEHICLE),
            judges.second,
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
            "a foreign node sends altered copies of the messages of a vehicle, some with another stamp",
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
