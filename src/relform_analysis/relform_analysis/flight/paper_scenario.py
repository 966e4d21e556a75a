"""Whether a flight is the paper's: whether its numbers can be read beside those of the paper."""

from functools import cache

from relform_core.errors import ConfigError
from relform_core.load import load_scenario
from relform_core.scenario_config import ScenarioConfig

PAPER = "paper"
"""Plain name of the paper's scenario."""
SECTIONS = (
    "team",
    "vehicle",
    "sensors",
    "formations",
    "sensing",
    "start",
    "ground",
    "phases",
    "events",
    "links",
    "obstacles",
)
"""What makes the paper's flight. The controller is free: the paper compares several."""


def is_paper(config: ScenarioConfig) -> bool:
    """Whether the paper's scenario was flown, with any controller."""
    return config.name == PAPER and not _unlike_paper(config)


def flown_title(config: ScenarioConfig) -> str:
    """The title of a scenario; if it is that of the paper, but the scenario is not, what was changed."""
    paper = _paper()
    if paper is None or config.title != paper.title or is_paper(config):
        return config.title
    changed = f"other {', '.join(unlike)}" if (unlike := _unlike_paper(config)) else "another name"
    return f"{config.name}: the paper's scenario with {changed}"


def _unlike_paper(config: ScenarioConfig) -> tuple[str, ...]:
    paper = _paper()
    return tuple(name for name in SECTIONS if paper and getattr(config, name) != getattr(paper, name))


@cache
def _paper() -> ScenarioConfig | None:
    """None: it is not installed."""
    try:
        return load_scenario(PAPER).config
    except ConfigError:
        return None
