"""The plots over time of a flight: their lines, and the levels to compare with."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.paper_claims import FORMATION_STEADY_MEAN_M
from relform_analysis.flight.paper_scenario import is_paper
from relform_analysis.flight.tracking_errors import (
    follower_yaw_errors,
    formation_errors,
    leader_errors,
    scored_pairs,
)
from relform_analysis.plots.palette import Style, pair_style, series_style, vehicle_style
from relform_core.arrays import Array
from relform_core.units import rad_s_to_rpm

ROTORS = ("front", "left", "back", "right")


@dataclass(frozen=True, eq=False)
class Line:
    """One value per control step."""

    name: str
    style: Style
    values: Array
    """Shape (K,)."""
    high: Array | None = None
    """Upper bound of a band, shape (K,); None: there is no band."""
    low: Array | None = None
    """Its lower bound, shape (K,); None: the band is symmetric about zero."""


@dataclass(frozen=True)
class Guide:
    """Levels to compare with."""

    label: str
    values: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Panel:
    """One plot."""

    title: str
    unit: str
    digits: int
    lines: Sequence[Line]
    guides: Sequence[Guide] = field(default=())
    log_scale: bool = False
    steps: bool = False
    """Values hold for the whole step, instead of at its instant."""
    is_error: bool = False
    """Values are errors, never negative: a few large ones must not flatten the others."""
    tall: bool = False
    """Whether it is a main result, which gets more height."""


def pair_label(observer: str, target: str) -> str:
    """Name of a pair: observer, then target."""
    return f"{observer} → {target}"


def scored_pair_styles(log: FlightLog) -> list[Style]:
    """Of the lines of the scored pairs, in their order."""
    place = {name: index for index, name in enumerate(log.vehicles)}
    pairs = scored_pairs(log.scenario.config.team)
    return [pair_style(place[observer], place[target], log.leader) for observer, target in pairs]


def flight_panels(log: FlightLog) -> dict[str, list[Panel]]:
    """All plots of the paper, from the formation to the solver, by the name of the figure that they make."""
    return {
        "formation_errors": _formation(log),
        "tracking_errors": _tracking(log),
        "rotor_speeds": _rotors(log),
        "solver": _solver(log),
    }


def _formation(log: FlightLog) -> list[Panel]:
    pairs = scored_pairs(log.scenario.config.team)
    lines = [
        Line(pair_label(*pair), style, error)
        for pair, style, error in zip(
            pairs, scored_pair_styles(log), formation_errors(log, pairs).T, strict=True
        )
    ]
    claims = []
    if is_paper(log.scenario.config):
        claims.append(Guide(f"paper < {FORMATION_STEADY_MEAN_M} m", (FORMATION_STEADY_MEAN_M,)))
    return [Panel("Formation error", "m", 3, lines, claims, tall=True, is_error=True)]


def _tracking(log: FlightLog) -> list[Panel]:
    position_error, yaw_error = leader_errors(log)
    leader = vehicle_style(log.leader)
    followers = [
        Line(log.vehicles[follower], vehicle_style(follower), error)
        for follower, error in zip(log.followers, np.degrees(follower_yaw_errors(log)).T, strict=True)
    ]
    return [
        Panel("Leader position error", "m", 3, [Line("position", leader, position_error)], is_error=True),
        Panel("Leader yaw error", "deg", 1, [Line("yaw", leader, np.degrees(yaw_error))], is_error=True),
        Panel("Yaw of the followers relative to the leader", "deg", 1, followers, is_error=True),
    ]


def rotor_summary(log: FlightLog) -> Panel:
    """Of each vehicle the mean over its rotors, in a band from the slowest to the fastest."""
    speeds = rad_s_to_rpm(1.0) * log.rotor_speeds
    lines = [
        Line(name, vehicle_style(index), each.mean(axis=-1), high=each.max(axis=-1), low=each.min(axis=-1))
        for index, (name, each) in enumerate(zip(log.vehicles, np.moveaxis(speeds, 1, 0), strict=True))
    ]
    title = "Rotor speeds: mean of each vehicle, in the band of its four"
    return Panel(title, "rpm", 0, lines, [_rotor_limits(log)])


def _rotor_limits(log: FlightLog) -> Guide:
    vehicle = log.scenario.config.vehicle
    low, high = rad_s_to_rpm(vehicle.rotor_speed_min), rad_s_to_rpm(vehicle.rotor_speed_max)
    return Guide(f"limits {low:.0f} and {high:.0f} rpm", (low, high))


def _rotors(log: FlightLog) -> list[Panel]:
    speeds, limits = rad_s_to_rpm(1.0) * log.rotor_speeds, _rotor_limits(log)
    return [
        Panel(
            f"Rotor speeds, {name}",
            "rpm",
            0,
            [Line(rotor, series_style(index), speeds[:, which, index]) for index, rotor in enumerate(ROTORS)],
            [limits],
            steps=True,
        )
        for which, name in enumerate(log.vehicles)
    ]


def _solver(log: FlightLog) -> list[Panel]:
    solver, controller = log.solver, log.scenario.config.controller
    prepare, feedback = 1e3 * solver["prepare_time"], 1e3 * solver["feedback_time"]
    tolerance = controller.solver.kkt_tolerance
    return [
        Panel(
            "Solver: objective",
            "",
            2,
            [Line("objective", series_style(0), solver["objective"])],
            log_scale=True,
        ),
        Panel(
            "Solver: KKT value",
            "",
            3,
            [
                Line("first SQP step", series_style(1), solver["kkt_first"]),
                Line("last SQP step", series_style(0), solver["kkt"]),
            ],
            [Guide(f"tolerance {tolerance:g}", (tolerance,))],
            log_scale=True,
        ),
        Panel(
            "Solver: time per control step",
            "ms",
            2,
            [
                Line("prepare and feedback", series_style(0), prepare + feedback),
                Line("feedback", series_style(1), feedback),
            ],
            [Guide(f"control period {1e3 * controller.period:g} ms", (1e3 * controller.period,))],
            log_scale=True,
        ),
        Panel(
            "Solver: SQP steps per control step",
            "",
            0,
            [Line("SQP steps", series_style(0), solver["sqp_steps"])],
            steps=True,
        ),
    ]
