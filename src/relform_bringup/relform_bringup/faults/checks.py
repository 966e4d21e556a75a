"""What must hold after a flight of the campaign: each check gives a line for each thing that does not."""

import re
from collections.abc import Iterator, Mapping

import numpy as np

from relform_bringup.faults.evidence import Ended, Evidence, Flown
from relform_bringup.faults.plan import FLY, Plan

ERROR_MAX = 0.25
"""Mean formation error over the last LAST_S of a flight that recovered from its fault [m]."""
LAST_S = 0.5
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
        code, pattern = (expected or {}).get(ended.name, (0, ""))
        words = [line for line in ended.lines if not HARMLESS.search(line)]
        if ended.code != code:
            yield f"{ended.name} exited with {ended.code} instead of {code}: {_last(ended)}"
        elif pattern and not (words and re.search(pattern, words[-1])):
            yield f"{ended.name} does not say '{pattern}': {_last(ended)}"
        elif ended.name != FLY and len(words) > bool(pattern):
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


def undisturbed(plan: Plan, evidence: Evidence, gap: float = 0.0) -> Iterator[str]:
    """The whole flight was flown, in formation, with commands all the time; ``gap`` as in ``commanded``."""
    yield from complete(plan, evidence)
    yield from in_the_air(evidence)
    yield from commanded(evidence, gap)
    yield from in_formation(evidence)


def _last(ended: Ended) -> str:
    return ended.lines[-1] if ended.lines else "(no output)"
