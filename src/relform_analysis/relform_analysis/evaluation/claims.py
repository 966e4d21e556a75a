"""The numbers that are compared with the paper, and the targets of the default tuning."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from relform_analysis.flight.paper_claims import COMPARED, FORMATION_STEADY_MEAN_M, STEP_MS, ComparedNumber
from relform_analysis.flight.summary import Json
from relform_analysis.flight.tracking_errors import scored_pairs
from relform_core.team_config import TeamConfig

SMALLER_IS_WORSE = ("separation_min_m", "view_margin_min_deg")


@dataclass(frozen=True)
class Target:
    """A bound on the mean over the flights, which the default tuning has to keep."""

    key: str
    label: str
    unit: str
    bound: float
    factor: float = 1.0

    def holds(self, mean: float | None) -> bool:
        """Whether it is kept."""
        return mean is not None and self.factor * mean <= self.bound


def pair_key(observer: str, target: str, number: str) -> str:
    """Name of a number of a pair in the rows of a sweep."""
    return f"pairs.{observer}.{target}.{number}"


def worst(number: ComparedNumber) -> str:
    """The statistic of the worst flight: the largest number, or the smallest."""
    return "min" if number.key in SMALLER_IS_WORSE else "max"


def compared_numbers(team: TeamConfig) -> list[ComparedNumber]:
    """All numbers that are compared with the paper, those of each pair and those without a claim included."""
    mean, *others = (number for number in COMPARED if number.key != "realtime_factor")
    pairs = [
        replace(mean, key=pair_key(*pair, mean.key), label=f"{pair[0]} to {pair[1]}, steady, mean")
        for pair in scored_pairs(team)
    ]
    more = [
        ComparedNumber(
            "leader_yaw_max_deg", "leader yaw error, maximum of all", "high in the turn only", "deg", 1
        ),
        ComparedNumber("follower_yaw_max_deg", "follower yaw error, maximum of all", "", "deg", 1),
        ComparedNumber("phases.D.settling_s", "formation change settled after", "some time", "s", 2),
        ComparedNumber("kkt_first_median", "KKT value, first SQP step, median", "", "", 0),
        ComparedNumber("kkt_median", "KKT value, last SQP step, median", "small; tolerance 10", "", 1),
        ComparedNumber(
            "step_ms_max", "solver time per control step, maximum", f"always < {STEP_MS:.0f} ms", "ms", 1
        ),
    ]
    return [mean, *pairs, *others, *more]


def targets(team: TeamConfig) -> list[Target]:
    """Bounds on the default tuning with raw feedback, over all its flights."""
    pairs = [
        Target(pair_key(*pair, "steady_mean_m"), f"{pair[0]} to {pair[1]}", "m", 0.075)
        for pair in scored_pairs(team)
    ]
    return [
        Target("steady_mean_m", "formation error, steady, mean", "m", FORMATION_STEADY_MEAN_M),
        *pairs,
        Target("rotor_std_rpm", "rotor speed, standard deviation", "rpm", 650.0),
        Target("saturated_fraction", "steps with a rotor at its limit", "%", 5.0, 100.0),
        Target("leader_steady_mean_m", "leader position error, steady, mean", "m", 0.15),
        Target("leader_yaw_steady_mean_deg", "leader yaw error, steady, mean", "deg", 3.0),
    ]


def unkept(variant: Json, team: TeamConfig) -> list[str]:
    """The targets that a variant misses, one line each."""
    missed = [
        f"{target.label}: unknown"
        if mean is None
        else f"{target.label}: {target.factor * mean:.4g} {target.unit}, must be at most {target.bound:g}"
        for target in targets(team)
        if not target.holds(mean := mean_of(variant, target.key))
    ]
    lost = variant["runs"] - variant["completed"]
    return [f"{lost} of {variant['runs']} flights not completed"] * bool(lost) + missed


def mean_of(variant: Json, key: str) -> float | None:
    """Mean of a number over the completed flights of a variant; None if no flight has it."""
    mean: float | None = variant["metrics"].get(key, {}).get("mean")
    return mean


def of_variant(variants: Sequence[Json], name: str) -> Json:
    """The statistics of one variant."""
    return next(variant for variant in variants if variant["name"] == name)
