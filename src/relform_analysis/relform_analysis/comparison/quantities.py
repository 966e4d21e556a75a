"""What flights are compared by over time: one value per control step of each, of what they have in common."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from relform_analysis.comparison.common import CommonPart
from relform_analysis.flight.estimation_errors import leader_estimation_errors, pair_estimation_errors
from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.metrics import separations, tilts
from relform_analysis.flight.tracking_errors import (
    follower_yaw_errors,
    formation_errors,
    leader_errors,
    scored_pairs,
)
from relform_analysis.plots.panels import pair_label
from relform_core.arrays import Array
from relform_core.units import rad_s_to_rpm


@dataclass(frozen=True)
class Quantity:
    """One plot over time, with a line for each flight."""

    title: str
    unit: str
    digits: int
    values: Callable[[CommonPart], Array]
    """At every control step of a flight in the unit, shape (K,); NaN: not recorded."""
    log_scale: bool = False
    steps: bool = False
    """Values hold for the whole step, instead of at its instant."""
    is_error: bool = False
    """Values are errors, never negative: a few large ones must not flatten the others."""
    is_main: bool = False
    """Whether it is a main result, which gets more height."""


def pair_errors(part: CommonPart) -> Array:
    """Formation error of the common pairs [m], shape (K, pairs)."""
    return formation_errors(part.log, part.named_pairs)


def leader_position_error(part: CommonPart) -> Array:
    """Distance of the leader from its reference [m], shape (K,)."""
    return leader_errors(part.log)[0]


def leader_yaw_error(part: CommonPart) -> Array:
    """[deg], shape (K,)."""
    return np.degrees(leader_errors(part.log)[1])


def follower_yaws(part: CommonPart) -> Array:
    """Yaw of the common followers relative to the leader [deg], shape (K, followers)."""
    places = [part.log.followers.index(vehicle) for vehicle in part.vehicles[1:]]
    return np.degrees(follower_yaw_errors(part.log)[:, places])


def least_separation(part: CommonPart) -> Array:
    """Of the common vehicles at every control step [m], shape (K,)."""
    return separations(_at_steps(part.log, part.log.p_NB_N)[:, list(part.vehicles)])


def largest_tilt(part: CommonPart) -> Array:
    """Of the common vehicles [deg], shape (K,)."""
    of_vehicles = tilts(_at_steps(part.log, part.log.q_NB)[:, list(part.vehicles)])
    return np.asarray(np.degrees(of_vehicles.max(axis=1)))


def rotor_rpm(part: CommonPart) -> Array:
    """Commanded to the common vehicles [rpm], shape (K, vehicles, 4)."""
    return rad_s_to_rpm(1.0) * part.log.rotor_speeds[:, list(part.vehicles)]


def step_ms(part: CommonPart) -> Array:
    """Preparation and feedback of the solver [ms], shape (K,)."""
    return 1e3 * (part.log.solver["prepare_time"] + part.log.solver["feedback_time"])


def pair_position_estimates(part: CommonPart) -> Array:
    """Errors of the estimated relative positions of the common pairs [mm], shape (K, pairs)."""
    return np.asarray(1e3 * np.linalg.norm(_pair_estimates(part)[..., :3], axis=-1))


def pair_yaw_estimates(part: CommonPart) -> Array:
    """Errors of their estimated relative yaws [deg], shape (K, pairs)."""
    return np.degrees(np.abs(_pair_estimates(part)[..., 3]))


def leader_estimate(part: CommonPart) -> Array:
    """Distance of the estimate of the leader's position from the truth [mm], shape (K,)."""
    return np.asarray(1e3 * np.linalg.norm(leader_estimation_errors(part.log).errors[:, :3], axis=-1))


QUANTITIES = (
    Quantity(
        "Formation error, mean of the pairs",
        "m",
        3,
        lambda part: pair_errors(part).mean(axis=1),
        is_error=True,
        is_main=True,
    ),
    Quantity(
        "Formation error, largest of the pairs",
        "m",
        3,
        lambda part: pair_errors(part).max(axis=1),
        is_error=True,
    ),
    Quantity("Leader position error", "m", 3, leader_position_error, is_error=True),
    Quantity("Leader yaw error", "deg", 1, leader_yaw_error, is_error=True),
    Quantity(
        "Yaw of the followers, largest", "deg", 1, lambda part: follower_yaws(part).max(axis=1), is_error=True
    ),
    Quantity(
        "Altitude of the leader",
        "m",
        2,
        lambda part: _at_steps(part.log, part.log.p_NB_N)[:, part.log.leader, 2],
    ),
    Quantity("Smallest separation", "m", 2, least_separation),
    Quantity("Largest tilt", "deg", 1, largest_tilt),
    Quantity("Rotor speed, mean", "rpm", 0, lambda part: rotor_rpm(part).mean(axis=(1, 2)), steps=True),
    Quantity("Rotor speed, highest", "rpm", 0, lambda part: rotor_rpm(part).max(axis=(1, 2)), steps=True),
    Quantity(
        "Estimate − truth: relative positions, mean",
        "mm",
        1,
        lambda part: pair_position_estimates(part).mean(axis=1),
        is_error=True,
    ),
    Quantity(
        "Estimate − truth: relative yaws, mean",
        "deg",
        2,
        lambda part: pair_yaw_estimates(part).mean(axis=1),
        is_error=True,
    ),
    Quantity("Estimate − truth: position of the leader", "mm", 1, leader_estimate, is_error=True),
    Quantity("Solver: objective", "", 2, lambda part: part.log.solver["objective"], log_scale=True),
    Quantity(
        "Solver: KKT value of the first SQP step",
        "",
        3,
        lambda part: part.log.solver["kkt_first"],
        log_scale=True,
    ),
    Quantity(
        "Solver: KKT value of the last SQP step", "", 3, lambda part: part.log.solver["kkt"], log_scale=True
    ),
    Quantity("Solver: time per control step", "ms", 2, step_ms, log_scale=True),
    Quantity(
        "Solver: SQP steps per control step", "", 0, lambda part: part.log.solver["sqp_steps"], steps=True
    ),
)
"""In the order of the page; those of single pairs come behind."""


def pair_quantities(part: CommonPart) -> Iterator[Quantity]:
    """The formation error of each common pair, with the names of one flight."""
    for index, pair in enumerate(part.named_pairs):
        title = f"Formation error, {pair_label(*pair)}"
        yield Quantity(title, "m", 3, partial(_error_of_pair, index=index), is_error=True)


@dataclass(frozen=True, eq=False)
class Course:
    """A quantity of every flight over time."""

    quantity: Quantity
    values: tuple[Array, ...]
    """By flight, at each of its control steps, shape (K,)."""


def courses(parts: Sequence[CommonPart]) -> tuple[list[Course], list[str]]:
    """Every quantity that at least one flight has, and in words what some flights lack."""
    found: list[Course] = []
    lacking: dict[str, list[str]] = {part.flight.label: [] for part in parts}
    for quantity in (*QUANTITIES, *pair_quantities(parts[0])):
        values = tuple(quantity.values(part) for part in parts)
        known = [bool(np.isfinite(each).any()) for each in values]
        if not any(known):
            continue
        found.append(Course(quantity, values))
        for part, is_known in zip(parts, known, strict=True):
            if not is_known:
                lacking[part.flight.label].append(quantity.title)
    return found, [
        f"Not recorded in {label}: {'; '.join(titles)}." for label, titles in lacking.items() if titles
    ]


def _error_of_pair(part: CommonPart, index: int) -> Array:
    return formation_errors(part.log, [part.named_pairs[index]])[:, 0]


def _pair_estimates(part: CommonPart) -> Array:
    scored = scored_pairs(part.log.scenario.config.team)
    places = [scored.index(pair) for pair in part.named_pairs]
    return pair_estimation_errors(part.log).errors[:, places]


def _at_steps(log: FlightLog, values: Array) -> Array:
    return values[log.tick_of_step]
