"""Schema of ``config/scenarios/*.yaml`` as users write them: a scenario and its seed."""

from typing import Annotated

from pydantic import Field

from relform_core.scenario_config import ScenarioConfig


class ScenarioFile(ScenarioConfig):
    """Everything that defines a flight. ``load`` takes the seed out before it validates the rest."""

    seed: Annotated[int, Field(ge=0, examples=[7])] = 0
    """Seed of every random draw; the same seed gives the same flight. ``--seed`` replaces it."""
