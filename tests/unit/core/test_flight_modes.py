"""The requests that a team takes in each of its modes."""

import itertools

import pytest

from relform_core.flight_modes import ALLOWED, TeamMode, TeamRequest, refusal

TAKEN = {
    TeamMode.IDLE: {"take_off", "emergency_stop"},
    TeamMode.TAKING_OFF: {"emergency_land", "emergency_stop"},
    TeamMode.TAKING_OVER: {"emergency_land", "emergency_stop"},
    TeamMode.HOVERING: {
        "start", "hover", "go_to", "follow_trajectory", "set_formation", "land", "emergency_land",
        "emergency_stop",
    },
    TeamMode.FLYING: {
        "hover", "go_to", "follow_trajectory", "set_formation", "land", "emergency_land", "emergency_stop",
    },
    TeamMode.LANDING: {"emergency_land", "emergency_stop"},
    TeamMode.FAILSAFE: {"emergency_stop"},
    TeamMode.STOPPED: set(),
}  # fmt: skip


@pytest.mark.parametrize(("request_", "mode"), [*itertools.product(TeamRequest, TeamMode)])
def test_a_request_is_taken_or_refused_by_name(request_: TeamRequest, mode: TeamMode) -> None:
    problem = refusal(request_, mode)
    assert (problem is None) == (request_.value in TAKEN[mode])
    if problem is not None:
        assert problem.startswith(f"{request_.value} is refused: the team is {mode}, expected ")


def test_a_refusal_says_what_is_expected() -> None:
    assert (
        refusal(TeamRequest.LAND, TeamMode.TAKING_OFF)
        == "land is refused: the team is taking off, expected hovering or flying"
    )


def test_every_request_is_in_the_table() -> None:
    assert set(ALLOWED) == set(TeamRequest)
