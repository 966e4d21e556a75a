"""The palette for sixteen vehicles: distances between its colours as people of each kind of vision see them.

Distances are CIEDE2000: about 2 can just be seen side by side, 10 is seen at a glance.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pytest
from coloraide import Color

from relform_analysis.plots.palette import GROUP, VEHICLES, pair_style, vehicle_style

VISIONS = ("normal", "protan", "deutan", "tritan")
GROUNDS = {"light": "#ffffff", "dark": "#17191c"}
"""Behind the lines, by theme."""
SAME_GROUP, ACROSS = 11.0, 6.0
"""The least distances that are reached within a group, and between vehicles of different groups."""


def distances(colours: Sequence[str], vision: str) -> dict[tuple[int, int], float]:
    """Between each two colours; simulation by Vienot 1999 (protan, deutan) and Brettel 1997 (tritan)."""
    seen = [Color(colour) if vision == "normal" else Color(colour).filter(vision) for colour in colours]
    return {(i, j): seen[i].delta_e(seen[j], method="2000") for i, j in combinations(range(len(colours)), 2)}


@pytest.mark.parametrize("ground", GROUNDS)
@pytest.mark.parametrize("vision", VISIONS)
def test_colours_differ(ground: str, vision: str) -> None:
    apart = distances([getattr(ink, ground) for ink in VEHICLES], vision)
    same_group = min(distance for (i, j), distance in apart.items() if i // GROUP == j // GROUP)
    across = min(distance for (i, j), distance in apart.items() if i // GROUP != j // GROUP)
    assert same_group > SAME_GROUP
    assert across > ACROSS


@pytest.mark.parametrize("ground", GROUNDS)
def test_lines_stand_out_from_the_ground(ground: str) -> None:
    """By the contrast of 3 that WCAG 2.2 asks of graphics."""
    for ink in VEHICLES:
        assert Color(getattr(ink, ground)).contrast(GROUNDS[ground]) >= 3.0


def test_hue_is_that_of_the_other_theme() -> None:
    """Whoever changes the theme finds each vehicle again."""
    for ink in VEHICLES[1:]:
        light, dark = (Color(colour).convert("lab-d65") for colour in (ink.light, ink.dark))
        hues = [np.degrees(np.arctan2(colour["b"], colour["a"])) for colour in (light, dark)]
        assert abs((hues[0] - hues[1] + 180.0) % 360.0 - 180.0) < 30.0


def test_what_is_close_in_colour_differs_in_dashes() -> None:
    styles = [vehicle_style(place) for place in range(len(VEHICLES))]
    assert len({style.dash for style in styles[:GROUP]} & {style.dash for style in styles[GROUP:]}) == 0
    assert len(set(styles)) == len(VEHICLES)


def test_pairs_of_a_team_have_different_lines() -> None:
    """Of those that are scored: the leader sees each follower, each follower the one before it."""
    n = len(VEHICLES)
    seen_by_leader = [pair_style(0, follower, leader=0) for follower in range(1, n)]
    between = [pair_style(follower, follower - 1, leader=0) for follower in range(2, n)]
    assert seen_by_leader == [vehicle_style(follower) for follower in range(1, n)]
    assert len(set(seen_by_leader + between)) == 2 * n - 3
