"""The picture of docs/nodes.md: followers that change places, as planned and as flown."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.metrics import separations
from relform_analysis.flight.simulate import fly_in_process
from relform_analysis.plots.picture_command import draw_into_file
from relform_analysis.plots.style import BLUE, GREEN, GUIDE, TEXT, VEHICLE_COLOURS, VERMILION, cycled
from relform_core.blend import Blend
from relform_core.formation_change import FormationChanges
from relform_core.load import LoadedScenario, load_scenario
from relform_core.schema import Vector3
from relform_core.script import command
from relform_core.units import NANOSECONDS_PER_SECOND

SEED = 1
BEFORE_S, AFTER_S = 1.0, 5.0
"""Time before and after the change begins [s]."""


@dataclass(frozen=True)
class Change:
    """Followers that take the places of others."""

    title: str
    places: Mapping[str, Vector3]
    """At the start: each follower relative to the leader [m]."""
    takes_place_of: Mapping[str, str]

    def scenario(self) -> LoadedScenario:
        """A hover with this change, flown by the team estimator."""
        after = {name: self.places[self.takes_place_of.get(name, name)] for name in self.places}
        phases = ", ".join(
            f"{{name: {name}, title: {name}, duration_s: {duration}, steady_from_s: 0.0, formation: {name}, "
            "motion: {kind: hover, ramp_s: 0.0}}"
            for name, duration in (("before", BEFORE_S), ("after", AFTER_S))
        )
        return load_scenario(
            "paper",
            [
                "controller=team",
                f"team.followers=[{', '.join(self.places)}]",
                f"formations_m={{before: {_as_yaml(self.places)}, after: {_as_yaml(after)}}}",
                f"phases=[{phases}]",
            ],
            SEED,
        )


CHANGES = (
    Change(
        "two of two followers",
        {"follower_1": (-1.0, -0.5, -0.5), "follower_2": (-1.0, 0.5, -0.5)},
        {"follower_1": "follower_2", "follower_2": "follower_1"},
    ),
    Change(
        "three of four followers",
        {
            "follower_1": (-0.8, -0.5, -0.2),
            "follower_2": (-1.5, 0.0, 0.1),
            "follower_3": (-0.8, 0.5, 0.0),
            "follower_4": (-2.3, 0.4, 0.3),
        },
        {"follower_1": "follower_2", "follower_2": "follower_3", "follower_3": "follower_1"},
    ),
)


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Draw the picture; returns the exit code."""
    description = "Draw followers that change places, as planned and as flown."
    return draw_into_file("formation_changes", description, lambda: picture(CHANGES), arguments)


def picture(changes: Sequence[Change]) -> Figure:
    """Each change from above, and the smallest distance of two vehicles during all of them."""
    figure = Figure(figsize=(11.0, 3.6), layout="constrained")
    over_time = figure.add_subplot(1, len(changes) + 1, len(changes) + 1)
    for column, (change, colour) in enumerate(zip(changes, (BLUE, GREEN), strict=True), 1):
        scenario = change.scenario()
        log = fly_in_process(scenario)
        _draw_from_above(figure.add_subplot(1, len(changes) + 1, column), change.title, log, way(scenario))
        over_time.plot(
            log.tick_ns / NANOSECONDS_PER_SECOND, separations(log.p_NB_N), color=colour, label=change.title
        )
    config = scenario.config
    limits, least = config.controller.formation_change, config.vehicle.separation_min
    assert limits is not None
    over_time.axhline(least, color=VERMILION, linewidth=0.9)
    over_time.axhline(least + limits.margin, color=GUIDE, linewidth=0.9)
    over_time.set_ylim(0.0, None)
    over_time.set_xlabel("time [s]")
    over_time.set_title("smallest distance of two vehicles [m]")
    over_time.legend(fontsize=7)
    return figure


def way(scenario: LoadedScenario) -> Blend:
    """The way of all vehicles from the first formation to the second."""
    changes, config = FormationChanges(scenario.config), scenario.config
    before, after = (config.formations[phase.formation] for phase in config.phases)
    return changes.begin(changes.at_rest(before), BEFORE_S, after)


def _draw_from_above(axes: Any, title: str, log: FlightLog, way: Blend) -> None:
    """Forward is up, left is left; the planned way behind the flown one."""
    planned = way.at(np.linspace(0.0, way.duration, 200))
    flown = np.moveaxis(log.p_NB_N - log.p_NB_N[:, :1], 1, 0)  # the leader does not turn
    axes.scatter(0.0, 0.0, color=TEXT, s=38)
    for vehicle in range(1, len(planned)):
        colour = cycled(VEHICLE_COLOURS, vehicle)
        (right, forward), (right_flown, forward_flown) = (
            (-path[vehicle, :, 1], path[vehicle, :, 0]) for path in (planned, flown)
        )
        axes.plot(right, forward, color=colour, linewidth=5.0, alpha=0.25)
        axes.plot(right_flown, forward_flown, color=colour, linewidth=1.2)
        axes.scatter(right_flown[::10], forward_flown[::10], color=colour, s=9)
        axes.scatter(right[0], forward[0], facecolors="none", edgecolors=colour, s=60)
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(color=GUIDE, alpha=0.25)
    axes.set_title(title)
    axes.set_xlabel("to the right [m]")
    axes.set_ylabel("forward [m]")


def _as_yaml(places: Mapping[str, Vector3]) -> str:
    return "{" + ", ".join(f"{name}: {list(place)}" for name, place in places.items()) + "}"
