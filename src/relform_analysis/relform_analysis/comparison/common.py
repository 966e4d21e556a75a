"""What flights have in common: vehicles, pairs, time and phases; and in words, what they have not."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from relform_analysis.comparison.flights import ComparedFlight
from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.phases import FlownPhase, flown_phases, step_times
from relform_analysis.flight.tracking_errors import scored_pairs
from relform_core.arrays import Mask

INSTANTS_DIFFER = 1e-6
"""Instants that are rounded differ by less [s]."""


@dataclass(frozen=True, eq=False)
class CommonPart:
    """One flight, with the part of it that the other flights have, too."""

    flight: ComparedFlight
    vehicles: tuple[int, ...]
    """Indices of the common vehicles in this team, leader first, in the same order for every flight."""
    pairs: tuple[tuple[int, int], ...]
    """Observer and target of the common scored pairs, as indices in this team, likewise."""
    steps: Mask
    """The control steps in the common time, shape (K,)."""

    @property
    def log(self) -> FlightLog:
        """The whole flight."""
        return self.flight.log

    @property
    def named_pairs(self) -> list[tuple[str, str]]:
        """Observer and target of the common scored pairs, by their names in this team."""
        names = self.log.vehicles
        return [(names[i], names[j]) for i, j in self.pairs]


@dataclass(frozen=True, eq=False)
class Common:
    """What some flights have in common."""

    parts: tuple[CommonPart, ...]
    """One per flight."""
    start: float
    end: float
    """The time at which all of them flew [s]."""
    phases: tuple[str, ...]
    """Names of the phases that all of them began in the common time."""
    limits: tuple[str, ...]
    """What cannot be compared, and why, a sentence each; empty: everything can."""


def common_of(flights: Sequence[ComparedFlight]) -> Common:
    """Find what flights with at least one control step each have in common."""
    vehicles, limits = _common_vehicles(flights)
    pairs, more = _common_pairs(flights, vehicles)
    limits += more
    times = [step_times(flight.log) for flight in flights]
    start, end = float(max(time[0] for time in times)), float(min(time[-1] for time in times))
    limits += _other_times(flights, start, end)
    steps = [(time > start - INSTANTS_DIFFER) & (time < end + INSTANTS_DIFFER) for time in times]
    parts = tuple(map(CommonPart, flights, vehicles, pairs, steps))
    phases, more = _common_phases(parts)
    return Common(parts, start, end, phases, (*limits, *more, *_other_paths(flights)))


def _common_vehicles(flights: Sequence[ComparedFlight]) -> tuple[list[tuple[int, ...]], list[str]]:
    """Indices of the common vehicles in each team: leader, then followers of the same name."""
    teams = [flight.log.scenario.config.team for flight in flights]
    followers = [name for name in teams[0].followers if all(name in team.followers for team in teams)]
    limits = []
    if followers:
        indices = [(0, *(team.vehicles.index(name) for name in followers)) for team in teams]
    else:
        shortest = min(len(team.followers) for team in teams)
        indices = [tuple(range(shortest + 1)) for _ in teams]
        limits.append(
            "No follower has the same name in all flights: followers are compared by their place in the team."
        )
    for flight, team, common in zip(flights, teams, indices, strict=True):
        if others := [name for index, name in enumerate(team.vehicles) if index not in common]:
            limits.append(f"{_named(others)} of {flight.label}: not in the team of every flight.")
    return indices, limits


def _common_pairs(
    flights: Sequence[ComparedFlight], vehicles: Sequence[tuple[int, ...]]
) -> tuple[list[tuple[tuple[int, int], ...]], list[str]]:
    """The scored pairs of common vehicles that are scored in every flight."""
    by_place, limits = [], []
    for flight, common in zip(flights, vehicles, strict=True):
        names = flight.log.vehicles
        place_of = {names[index]: place for place, index in enumerate(common)}
        scored = scored_pairs(flight.log.scenario.config.team)
        by_place.append([(place_of[i], place_of[j]) for i, j in scored if i in place_of and j in place_of])
    shared = [pair for pair in by_place[0] if all(pair in pairs for pairs in by_place)]
    for flight, common, pairs in zip(flights, vehicles, by_place, strict=True):
        names = flight.log.vehicles
        if others := [f"{names[common[i]]} → {names[common[j]]}" for i, j in pairs if (i, j) not in shared]:
            limits.append(f"The pair {_named(others)} of {flight.label}: not scored in every flight.")
    return [tuple((common[i], common[j]) for i, j in shared) for common in vehicles], limits


def _other_times(flights: Sequence[ComparedFlight], start: float, end: float) -> list[str]:
    """Flights that began earlier or ended later than others by more than a control step."""
    periods = {flight.log.scenario.config.controller.period for flight in flights}
    limits = []
    for flight in flights:
        time = step_times(flight.log)
        if time[0] < start - max(periods):
            limits.append(f"{flight.label} before {start:.2f} s: not every flight had begun.")
        if time[-1] > end + max(periods):
            limits.append(f"{flight.label} after {end:.2f} s: not every flight lasted longer.")
    if len(periods) > 1:
        listed = _named([f"{1e3 * period:g} ms" for period in sorted(periods)])
        limits.append(
            f"The control periods are {listed}: numbers of one control step, such as solver times, are of "
            "different steps."
        )
    return limits


def _common_phases(parts: Sequence[CommonPart]) -> tuple[tuple[str, ...], list[str]]:
    """Names of the phases that were begun in all flights, and where phases of this name differ."""
    begun = [
        {name: None for name, flown in zip(part.log.phase, part.steps.tolist(), strict=True) if flown}
        for part in parts
    ]
    phases: list[dict[str, FlownPhase]] = [
        {phase.name: phase for phase in flown_phases(part.log)} for part in parts
    ]
    common = tuple(name for name in phases[0] if all(name in names for names in begun))
    limits = []
    for part, found in zip(parts, phases, strict=True):
        if alone := [name for name in found if name not in common]:
            noun = "Phase" if len(alone) == 1 else "Phases"
            limits.append(f"{noun} {_named(alone)} of {part.flight.label}: not begun in every flight.")
    others = _differing(common, phases, lambda phase: phase.start)
    if others:
        limits.append(f"Phases begin at other times, {others}: plots are over the time of the flight.")
    others = _differing(common, phases, lambda phase: phase.steady - phase.start)
    if others:
        limits.append(f"Steady windows begin at other times of their phase, {others}.")
    return common, limits


def _differing(
    names: Sequence[str],
    phases: Sequence[Mapping[str, FlownPhase]],
    instant: Callable[[FlownPhase], float],
) -> str:
    """The phases in which an instant differs between flights, with these; empty: there are none.

    Phases that ended before their steady window are left out.
    """
    found = []
    for name in names:
        instants = [instant(flown[name]) for flown in phases if flown[name].steady < flown[name].end]
        if instants and np.ptp(instants) > INSTANTS_DIFFER:
            found.append(f"{name} at {_named([f'{each:.2f}' for each in instants])} s")
    return "; ".join(found)


def _other_paths(flights: Sequence[ComparedFlight]) -> list[str]:
    """Whether the leaders had other things to fly."""
    tasks = [
        (config.start, [(phase.motion, phase.duration) for phase in config.phases])
        for config in (flight.log.scenario.config for flight in flights)
    ]
    if all(task == tasks[0] for task in tasks[1:]):
        return []
    return ["Start or phases differ: paths and altitudes are of other tasks, only errors can be compared."]


def _named(names: Sequence[str]) -> str:
    *most, last = names
    return f"{', '.join(most)} and {last}" if most else last
