"""In which order the vehicles of a team take off and land, and when they cannot land."""

from collections.abc import Mapping

import numpy as np
import pytest

from relform_controller.ground_plan import LandingPlan, TakeOffPlan, heights, landing_problem
from relform_core.flight_modes import Request
from relform_core.telemetry import PairEstimate, TeamState
from support.scenarios import paper_scenario

GROUND = "ground={climb_speed_m_s: 0.5, interval_s: 1.5}"
PLACES = "formations_m.initial={follower_1: [-1.0, -0.5, 0.4], follower_2: [-1.0, 0.5, -0.5]}"


def state(places: Mapping[str, tuple[float, float, float]]) -> TeamState:
    pairs = tuple(
        PairEstimate("leader", name, np.array(place), np.array(place), 0.1, 1e-4, False)
        for name, place in places.items()
    )
    return TeamState("A", pairs, 0.1, 0.1)


def test_the_highest_place_takes_off_first() -> None:
    plan = TakeOffPlan(paper_scenario(GROUND, PLACES).config)
    first, second = Request.TAKE_OFF, Request.ARM
    assert plan.requests(0.0) == {"follower_1": first, "leader": second, "follower_2": second}
    assert plan.requests(1.5) == {"follower_1": first, "leader": first, "follower_2": second}
    assert set(plan.requests(3.0).values()) == {first}
    assert plan.time_max == pytest.approx(3.0 + 2.4 / 0.5 + 5.0)


def test_together_all_land_at_once() -> None:
    assert LandingPlan({"leader": 0.0, "wing": -0.5}).requests(0.0) == {
        "wing": Request.LAND,
        "leader": Request.LAND,
    }


def test_one_by_one_the_lowest_lands_first() -> None:
    plan = LandingPlan({"leader": 0.0, "wing": -0.5, "tail": 0.7}, interval=1.5)
    land, hover = Request.LAND, Request.HOVER
    assert plan.requests(0.0) == {"wing": land, "leader": hover, "tail": hover}
    assert plan.requests(1.6) == {"wing": land, "leader": land, "tail": hover}
    assert set(plan.requests(3.0).values()) == {land}


def test_heights_are_those_of_the_leaders_pairs() -> None:
    assert heights(state({"wing": (1.0, 2.0, -0.3)}), "leader") == {"leader": 0.0, "wing": -0.3}


def test_a_team_does_not_land_on_itself() -> None:
    config = paper_scenario(GROUND).config
    needed = config.vehicle.separation_min + 0.3
    apart = {"follower_1": (needed + 0.01, 0.0, -0.5), "follower_2": (0.0, -needed - 0.01, 0.3)}
    assert landing_problem(config, state(apart)) is None
    above = apart | {"follower_2": (needed + 0.01, -0.2, 2.0)}
    assert landing_problem(config, state(above)) == (
        f"'follower_2' is above or below 'follower_1': 0.20 m apart seen from above, at least {needed:.2f} m "
        "are needed; change the formation first"
    )
