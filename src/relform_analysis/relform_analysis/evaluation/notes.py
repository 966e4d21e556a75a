"""The note below each figure: the paper's claim, and the result here."""

import textwrap

from relform_analysis.evaluation.claims import pair_key
from relform_analysis.flight.paper_claims import (
    FORMATION_STEADY_MAX_M,
    FORMATION_STEADY_MEAN_M,
    ROTOR_STD_RPM,
    SQP_STEPS,
)
from relform_analysis.flight.summary import Json
from relform_analysis.flight.tracking_errors import scored_pairs
from relform_core.team_config import TeamConfig

LINE = 118
"""Characters that fit below a figure."""


def trajectories(variant: Json) -> str:
    """Below the 3D paths."""
    return _note(
        '"performance is quite satisfactory for all cases".',
        f"{variant['completed']} of {variant['runs']} flights completed; vehicles never closer than "
        f"{_number(variant, 'separation_min_m', 2, 'min')} m; thin lines: other seeds.",
    )


def solver(variant: Json) -> str:
    """Below objective, KKT values and times."""
    return _note(
        "the objective peaks in the turn and at the formation change, and is much higher without the "
        f"modified RTI; small KKT values; {SQP_STEPS} SQP steps for the vast majority; always below the "
        "control period.",
        f"{_number(variant, 'sqp_steps_median', 0)} SQP steps, with a KKT value of "
        f"{_number(variant, 'kkt_first_median', 0)} in the first and {_number(variant, 'kkt_median', 1)} in "
        f"the last, and {_number(variant, 'step_ms_median', 1)} ms for both (medians).",
    )


def formation(variant: Json, team: TeamConfig) -> str:
    """Below the formation errors."""
    pairs = (_number(variant, pair_key(*pair, "steady_mean_m"), 3) for pair in scored_pairs(team))
    return _note(
        f"below {FORMATION_STEADY_MEAN_M} m on average in steady state, at most around "
        f"{FORMATION_STEADY_MAX_M} m (sic); higher only when the scenario changes.",
        f"{_number(variant, 'steady_mean_m', 3)} m on average in steady state ({', '.join(pairs)} m), 95th "
        f"percentile {_number(variant, 'steady_p95_m', 3)} m, maximum of all flights "
        f"{_number(variant, 'steady_max_m', 3, 'max')} m.",
    )


def tracking(variant: Json) -> str:
    """Below the leader's errors."""
    return _note(
        "slight position errors in dynamic cases; high yaw errors only in the agile turn.",
        f"{_number(variant, 'leader_steady_mean_m', 3)} m and "
        f"{_number(variant, 'leader_yaw_steady_mean_deg', 1)} deg on average in steady state; the largest of "
        f"a flight {_number(variant, 'leader_max_m', 2)} m and "
        f"{_number(variant, 'leader_yaw_max_deg', 0)} deg.",
    )


def rotors(variant: Json, seed: int) -> str:
    """Below the rotor speeds."""
    return _note(
        f"never beyond the limits; chattering, but quite steady, changes around {ROTOR_STD_RPM:.0f} rpm.",
        f"the flight with seed {seed}. In all flights the standard deviation is "
        f"{_number(variant, 'rotor_std_rpm', 0)} rpm, and some rotor is at its limit in "
        f"{_number(variant, 'saturated_fraction', 1, factor=100.0)} % of the steps.",
    )


def followers(variant: Json) -> str:
    """Below the followers' yaw and the margin of the field of view."""
    return _note(
        "(without a figure) followers follow the leader's yaw, too; low errors imply that the field of view "
        "suffices.",
        f"{_number(variant, 'follower_yaw_steady_mean_deg', 1)} deg on average in steady state, "
        f"{_number(variant, 'follower_yaw_max_deg', 1, 'max')} deg at most; the least margin of all flights "
        f"is {_number(variant, 'view_margin_min_deg', 1, 'min')} deg.",
    )


def _note(claimed: str, found: str) -> str:
    return "\n".join(textwrap.fill(text, LINE) for text in (f"Paper: {claimed}", f"Here: {found}"))


def _number(variant: Json, key: str, digits: int, statistic: str = "mean", factor: float = 1.0) -> str:
    value = variant["metrics"][key][statistic]
    return "-" if value is None else f"{factor * value:.{digits}f}"
