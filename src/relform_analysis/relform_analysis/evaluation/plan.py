"""The flights of the evaluation: many of both tunings, as many of each ablation as the paper flew."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from relform_analysis.sweep.plan import Run, plan_runs
from relform_analysis.sweep.variant import Variant
from relform_core.errors import ConfigError

FULL, PAPER_TUNING = "full", "paper_tuning"
COLD = {FULL: "cold", PAPER_TUNING: "paper_tuning_cold"}
"""The variant without warm start that each tuning is compared with."""
WARM_STARTS = (FULL, "shift_only", "hold", "cold_two_steps", "one_step", "cold")
STRUCTURES = (FULL, "with_leader", "one_way", "gust", "gust_with_leader", "gust_one_way")
TUNINGS = (FULL, PAPER_TUNING, "paper_tuning_cold", "paper_literal")
PERFECT_SENSORS = ("noise_free", "paper_tuning_noise_free")
ALL = tuple(dict.fromkeys((*WARM_STARTS, *STRUCTURES, *TUNINGS, *PERFECT_SENSORS)))

FIRST_SEED, FEW, MANY = 1, 10, 50
"""The paper flew ten times."""


def plan_evaluation(scenario: Path | str, variants: Sequence[Variant], few: int, many: int) -> list[Run]:
    """All flights, those of the ablations only with the first few seeds.

    Raises:
        ConfigError: a variant is missing, or cannot be flown.
    """
    named = {variant.name for variant in variants}
    for name in ALL:
        if name not in named:
            raise ConfigError(f"the variants lack '{name}', which the evaluation needs")
    runs = plan_runs(scenario, variants, (), range(FIRST_SEED, FIRST_SEED + many))
    drawn = {*COLD, *COLD.values()}
    return [
        replace(run, keeps_log=run.variant in drawn)
        for run in runs
        if run.variant in COLD or run.seed < FIRST_SEED + few
    ]
