"""What must hold after a flight of the campaign: each check gives a line for each thing that does not."""

import re
from collections.abc import Iterator, Mapping

import numpy as np

from relform_bringup.faults.evidence import Ended, Evidence, Flown, VehicleFlown
from relform_bringup.faults.plan import CONTROLLER, FLY, Action, Plan
from relform_core.names import CONTROLLER_NODE

ERROR_MAX = 0.25
"""Mean formation error over the last LAST_S of a flight that recovered from its fault [m]."""
LAST_S = 0.5
GROUND_M = 0.15
"""Height below which a vehicle stands on its legs [m]."""
TILT_MAX = 0.1
"""Of a vehicle that stands on the ground [rad]."""
TAKE_OVER_MAX = 2.0
"""From the admission of a controller to its first command [s]."""
START_MAX = 4.5
"""In which a process starts, on a busy machine [s]; vehicles that sink slowly are high enough for so long."""
GAP_MAX = 0.6
"""Longest time without commands beside the fault itself, on a busy machine [s]; vehicles fly their plan."""
HARMLESS = re.compile(
    r"still waiting for|: waits for|takes the team over|admitted another process|refused another process|RTPS"
)
"""Lines that a process may print though it ends well; those with RTPS come from the middleware."""
PERIOD_S = 0.05


def all_ended(evidence: Evidence) -> Iterator[str]:
    """No hang, no orphan, no traceback."""
    for ended in evidence.ends:
        if ended.code is None:
            yield f"{ended.name} hangs"
        if "Traceback" in ended.output:
            yield f"{ended.name} prints a traceback"
    for command in evidence.orphans:
        yield f"left running: {command[:120]}"


def has_bag(evidence: Evidence) -> Iterator[str]:
    """The bag can be read, and two readers agree on it."""
    if evidence.bag_problem:
        yield evidence.bag_problem


def exits(evidence: Evidence, expected: Mapping[str, tuple[int, str]] | None = None) -> Iterator[str]:
    """Each process that was not killed has the exit code that is expected, and says why.

    Args:
        expected: by the name of a process, its code, and a pattern of its last line; others: 0, no output.
    """
    for ended in evidence.ends:
        if ended.was_killed or ended.code is None:
            continue
        code, pattern = (130, "") if ended.was_dismissed else (expected or {}).get(ended.name, (0, ""))
        words = [line for line in ended.lines if not HARMLESS.search(line)]
        by_fly = ended.name.startswith(FLY)  # it prints more than its reason
        if ended.was_dismissed and ended.code == 0:  # a viewer
            continue
        if ended.code != code:
            yield f"{ended.name} exited with {ended.code} instead of {code}: {_last(ended)}"
        elif pattern and not any(re.search(pattern, line) for line in (words if by_fly else words[-1:])):
            yield f"{ended.name} does not say '{pattern}': {_last(ended)}"
        elif not by_fly and len(words) > bool(pattern):
            yield f"{ended.name} prints {len(words)} lines: {words[0]}"


def complete(plan: Plan, evidence: Evidence) -> Iterator[str]:
    """Every step was flown and recorded."""
    if (flown := evidence.flown) is None:
        return
    n_steps = round(plan.duration / PERIOD_S)
    if missing := sorted(set(range(n_steps + 1)) - set(flown.steps.tolist())):
        yield f"{len(missing)} of {n_steps + 1} steps are missing, the first is {missing[0]}"


def in_the_air(evidence: Evidence) -> Iterator[str]:
    """No vehicle crashed."""
    if (flown := evidence.flown) is not None:
        yield from (f"fault of a vehicle: {fault}" for fault in flown.vehicle_faults)


def commanded(evidence: Evidence, gap: float = 0.0) -> Iterator[str]:
    """Commands came all the time.

    Args:
        gap: time without commands that the fault itself causes [s].
    """
    if (flown := evidence.flown) is None:
        return
    for name, vehicle in flown.vehicles.items():
        longest = float(np.diff(vehicle.command_times).max(initial=0.0))
        if longest > gap + GAP_MAX:
            yield f"{name} had no commands for {longest:.2f} s, allowed are {gap + GAP_MAX:.2f} s"


def in_formation(evidence: Evidence) -> Iterator[str]:
    """At its end the team is in formation."""
    if (flown := evidence.flown) is None:
        return
    if (error := final_error(flown)) > ERROR_MAX:
        yield f"formation error {error:.3f} m at the end, allowed are {ERROR_MAX} m"


def final_error(flown: Flown) -> float:
    """Mean formation error over the last LAST_S of the flight [m]; infinite without a decision there."""
    if not len(flown.steps):
        return np.inf
    last = flown.error_times > flown.steps[-1] * PERIOD_S - LAST_S
    return float(flown.formation_errors[last].mean()) if last.any() else np.inf


def landed(evidence: Evidence) -> Iterator[str]:
    """All vehicles stand on the ground, level and at rest."""
    if (flown := evidence.flown) is None:
        return
    for name, vehicle in flown.vehicles.items():
        height, speed, tilt = (values[-1] for values in (vehicle.heights, vehicle.speeds, vehicle.tilts))
        if height > GROUND_M or speed > 0.05 or tilt > TILT_MAX:
            yield f"{name} ends at {height:.2f} m, {speed:.2f} m/s, tilted by {tilt:.2f} rad"


def takeover(plan: Plan, evidence: Evidence) -> tuple[float, float] | None:
    """How soon another controller commanded all vehicles: from its admission, from its start [s].

    None: no controller was lost, or none took the team over.
    """
    done = {
        (fault.action, fault.target): time for fault, time in zip(plan.faults, evidence.done, strict=False)
    }
    admitted = _admission(evidence)
    started = done.get((Action.START, CONTROLLER))
    if (flown := evidence.flown) is None or admitted is None or started is None:
        return None
    firsts = [_first_after(started, vehicle) for vehicle in flown.vehicles.values()]
    if None in firsts:
        return None
    last = max(first for first in firsts if first is not None)
    return last - admitted, last - started


def _admission(evidence: Evidence) -> float | None:
    """When a controller was admitted in flight [s]; None: none was."""
    admissions = () if evidence.flown is None else evidence.flown.admissions
    times = [time for time, node, is_admitted in admissions if is_admitted and node == CONTROLLER_NODE]
    return times[0] if times else None


def _first_after(time: float, vehicle: VehicleFlown) -> float | None:
    """The instant of the first command after a time [s]; None: there is none."""
    later = vehicle.command_times[vehicle.command_times > time]
    return float(later[0]) if len(later) else None


def taken_over(plan: Plan, evidence: Evidence) -> Iterator[str]:
    """The controller that was started again commands the team soon."""
    if evidence.flown is None:
        return
    if (times := takeover(plan, evidence)) is None:
        yield "no controller took the team over"
    elif times[0] > TAKE_OVER_MAX:
        yield f"it commands the team {times[0]:.2f} s after its admission, allowed are {TAKE_OVER_MAX} s"


def came_late(evidence: Evidence) -> bool:
    """Whether a process needed so long to start that the flight was over, or the vehicles were low."""
    if any(ended.was_dismissed for ended in evidence.ends):
        return True
    admitted = _admission(evidence)
    return admitted is not None and admitted - evidence.done[-1] > START_MAX


def counted(evidence: Evidence) -> Iterator[str]:
    """The nodes have counted messages that they did not use."""
    if (flown := evidence.flown) is None:
        return
    numbers = [
        int(number)
        for values in flown.reports.values()
        for key, number in values.items()
        if key.startswith("rejected.")
    ]
    if not any(numbers):
        yield "no node has counted a message that it rejected"


def reaches_end(plan: Plan, evidence: Evidence) -> Iterator[str]:
    """The clock ran to the end of the flight, whoever recorded it."""
    if evidence.ticked < plan.duration - 1e-6:
        yield f"the clock ended at {evidence.ticked:.2f} s, not at {plan.duration:.2f} s"


def undisturbed(plan: Plan, evidence: Evidence, gap: float = 0.0) -> Iterator[str]:
    """The whole flight was flown, in formation, with commands all the time; ``gap`` as in ``commanded``."""
    yield from complete(plan, evidence)
    yield from in_the_air(evidence)
    yield from commanded(evidence, gap)
    yield from in_formation(evidence)


def _last(ended: Ended) -> str:
    return ended.lines[-1] if ended.lines else "(no output)"
