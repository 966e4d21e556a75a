"""The picture of docs/scenarios.md: the leader's motions, as the scenarios of this project fly them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from relform_analysis.plots.picture_command import draw_into_file
from relform_analysis.plots.style import GUIDE, TEXT, VEHICLE_COLOURS, cycled
from relform_controller.reference.trajectory import LeaderTrajectory
from relform_core.load import load_scenario
from relform_core.scenario_config import ScenarioConfig
from relform_core.script import command

SCENARIOS = ("paper", "circle", "figure_eight", "waypoints", "tower")
"""By plain name; together they have every kind of motion."""


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Draw the picture; returns the exit code."""
    description = "Draw the motions of the leader."
    return draw_into_file(
        "motions", description, lambda: picture([load_scenario(name).config for name in SCENARIOS]), arguments
    )


def picture(configs: Sequence[ScenarioConfig]) -> Figure:
    """The leader's path in each scenario from above, a dot each second and a colour for each phase."""
    figure = Figure(figsize=(13.0, 3.6), layout="constrained")
    for column, config in enumerate(configs, 1):
        _draw(figure.add_subplot(1, len(configs), column), config)
    return figure


def _draw(axes: Any, config: ScenarioConfig) -> None:
    instants_ns = np.arange(config.n_steps + 1) * config.period_ns
    p_NB_N = LeaderTrajectory(config, 0).at(instants_ns).p_NB_N
    for index, (phase, first) in enumerate(zip(config.phases, config.phase_starts, strict=True)):
        last = first + round(phase.duration / config.controller.period)
        colour = cycled(VEHICLE_COLOURS, index + 1)
        every = max(1, round(1.0 / config.controller.period))
        axes.plot(*p_NB_N[first : last + 1, :2].T, color=colour, linewidth=1.4, label=phase.motion.kind)
        axes.scatter(*p_NB_N[first : last + 1 : every, :2].T, color=colour, s=9)
    axes.scatter(*p_NB_N[0, :2], facecolors="none", edgecolors=TEXT, s=60, zorder=3)
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(color=GUIDE, alpha=0.25)
    axes.set_title(config.name)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=2)
