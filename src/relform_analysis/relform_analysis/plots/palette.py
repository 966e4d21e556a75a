"""The colours and dashes of vehicles, pairs and other lines, the same in every picture.

A team may have sixteen vehicles. Sixteen colours cannot be far apart for people who lack one of three kinds
of cones, so there are two groups of eight: the colours of a group differ for everyone, and the lines of the
second group are dashed. ``tests/unit/analysis/test_palette.py`` measures the distances.
"""

from dataclasses import dataclass

Dash = tuple[float, ...]
"""Lengths of strokes and gaps, in widths of the line; empty: solid."""


@dataclass(frozen=True)
class Ink:
    """A colour, as #rrggbb, on light and on dark ground."""

    light: str
    dark: str


@dataclass(frozen=True)
class Style:
    """How a line looks."""

    colour: str
    """Name of an ink: ``vehicle-0`` to ``vehicle-15``, ``series-0`` to ``series-2``."""
    dash: Dash = ()


GROUP = 8
"""Vehicles whose colours differ for everyone; those of the next group have dashed lines."""
VEHICLES = (
    Ink("#1d1f22", "#e9eaec"),
    Ink("#d55e00", "#f5893d"),
    Ink("#0072b2", "#56b4e9"),
    Ink("#263c8a", "#8c76c6"),
    Ink("#b58d65", "#a98264"),
    Ink("#97676a", "#8c576c"),
    Ink("#883a5d", "#d4a2b4"),
    Ink("#455530", "#377908"),
    Ink("#880146", "#a84d51"),
    Ink("#b257f8", "#ff88ff"),
    Ink("#f35f89", "#d37197"),
    Ink("#70658b", "#8f639d"),
    Ink("#5b3902", "#f6e04d"),
    Ink("#3b7544", "#caf8c1"),
    Ink("#7908c4", "#225ef3"),
    Ink("#0f9a3b", "#92b27f"),
)
"""By place in the team: leader, first, second, ... follower.

Simulated annealing found those with the largest least distance for normal vision and for each kind of
colour-blindness, with a contrast of 3 to the ground. The first three were given."""
SERIES = (
    Ink("#1d1f22", "#e9eaec"),
    Ink("#d55e00", "#f5893d"),
    Ink("#0072b2", "#56b4e9"),
    Ink("#009e73", "#2cc295"),
)
"""Lines of a plot that belong to no vehicle: x, y, z, rotors, and values of the solver."""
SECOND_GROUP: Dash = (9.0, 2.5, 2.0, 2.5)
BETWEEN_FOLLOWERS: Dash = (4.0, 2.5)
BETWEEN_FOLLOWERS_OF_SECOND_GROUP: Dash = (1.5, 2.0)


def vehicle_style(vehicle: int) -> Style:
    """Of a vehicle, by its place in the team; the colours begin again after sixteen."""
    place = vehicle % len(VEHICLES)
    return Style(f"vehicle-{place}", SECOND_GROUP if place >= GROUP else ())


def pair_style(observer: int, target: int, leader: int) -> Style:
    """Of a pair, by the places of its vehicles in the team.

    What the leader sees has the colour of the follower that it sees; what a follower sees has its own colour,
    and other dashes.
    """
    if observer == leader:
        return vehicle_style(target)
    style = vehicle_style(observer)
    return Style(style.colour, BETWEEN_FOLLOWERS_OF_SECOND_GROUP if style.dash else BETWEEN_FOLLOWERS)


def series_style(number: int) -> Style:
    """Of the first, second, ... line that belongs to no vehicle."""
    return Style(f"series-{number}")


def inks() -> dict[str, Ink]:
    """Every ink by its name."""
    groups = {"vehicle": VEHICLES, "series": SERIES}
    return {f"{name}-{index}": ink for name, group in groups.items() for index, ink in enumerate(group)}
