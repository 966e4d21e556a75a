"""Every transition between the modes of a vehicle, and every request that it refuses."""

import itertools

import pytest

from relform_core.flight_modes import Request, VehicleMode
from relform_sim.mode_table import HAPPENED, REQUESTED, Happening, ModeMachine

M, R, H = VehicleMode, Request, Happening

FOLLOWS = {
    M.IDLE: {R.REST: M.IDLE, R.LAND: M.IDLE, R.ARM: M.ARMED, R.TAKE_OFF: M.ARMED},
    M.ARMED: {R.REST: M.IDLE, R.LAND: M.IDLE, R.ARM: M.ARMED, R.TAKE_OFF: M.TAKING_OFF},
    M.TAKING_OFF: {R.TAKE_OFF: M.TAKING_OFF, R.HOVER: M.HOVERING, R.LAND: M.LANDING},
    M.HOVERING: {R.TAKE_OFF: M.HOVERING, R.HOVER: M.HOVERING, R.FLY: M.FLYING, R.LAND: M.LANDING},
    M.FLYING: {R.FLY: M.FLYING, R.HOVER: M.HOVERING, R.LAND: M.LANDING},
    M.LANDING: {R.HOVER: M.HOVERING, R.LAND: M.LANDING},
    M.FAILSAFE: {R.FLY: M.FLYING, R.HOVER: M.HOVERING, R.LAND: M.LANDING},
    M.STOPPED: {},
}
"""Besides STOP, which every mode obeys."""


def machine(mode: VehicleMode) -> ModeMachine:
    return ModeMachine(mode)


@pytest.mark.parametrize(("mode", "request_"), list(itertools.product(M, R)))
def test_each_request_in_each_mode(mode: VehicleMode, request_: Request) -> None:
    asked = machine(mode)
    is_allowed = asked.step(request_, frozenset())
    if request_ is R.STOP:
        assert (is_allowed, asked.mode) == (True, M.STOPPED)
    elif request_ in FOLLOWS[mode]:
        assert (is_allowed, asked.mode) == (True, FOLLOWS[mode][request_])
        assert asked.reason == (f"asked to {request_}" if asked.mode is not mode else "")
    else:
        assert (is_allowed, asked.mode) == (False, mode)
        assert asked.reason == f"refuses to {request_} while {mode}"


@pytest.mark.parametrize(
    ("mode", "happening", "following"),
    [
        (M.TAKING_OFF, H.UP, M.HOVERING),
        (M.TAKING_OFF, H.SILENT, M.FAILSAFE),
        (M.HOVERING, H.SILENT, M.FAILSAFE),
        (M.HOVERING, H.NO_PLAN, M.FAILSAFE),
        (M.FLYING, H.NO_PLAN, M.FAILSAFE),
        (M.HOVERING, H.WEAK, M.FAILSAFE),
        (M.FLYING, H.WEAK, M.FAILSAFE),
        (M.LANDING, H.DOWN, M.IDLE),
        (M.FAILSAFE, H.DOWN, M.STOPPED),
    ],
)
def test_what_happens_changes_the_mode_and_gives_the_reason(
    mode: VehicleMode, happening: Happening, following: VehicleMode
) -> None:
    flying = machine(mode)
    assert flying.step(None, frozenset({happening}))
    assert (flying.mode, flying.reason) == (following, happening.value)
    flying.step(None, frozenset())
    assert flying.reason == happening.value  # it stays until the mode changes


def test_nothing_else_happens() -> None:
    assert sum(map(len, HAPPENED.values())) == 9
    for mode, happening in itertools.product(M, H):
        if happening not in HAPPENED.get(mode, {}):
            unmoved = machine(mode)
            unmoved.step(None, frozenset({happening}))
            assert (unmoved.mode, unmoved.reason) == (mode, "")


def test_silence_comes_before_the_end_of_the_climb() -> None:
    climbing = machine(M.TAKING_OFF)
    climbing.step(None, frozenset({H.UP, H.SILENT}))
    assert climbing.mode is M.FAILSAFE


def test_a_request_is_judged_by_the_mode_that_a_happening_has_led_to() -> None:
    climbing = machine(M.TAKING_OFF)
    assert climbing.step(R.FLY, frozenset({H.UP}))
    assert climbing.mode is M.FLYING
    landing = machine(M.LANDING)
    assert not landing.step(R.HOVER, frozenset({H.DOWN}))
    assert (landing.mode, landing.reason) == (M.IDLE, "refuses to hover while idle")
    failing = machine(M.FAILSAFE)
    assert not failing.step(R.FLY, frozenset({H.DOWN}))
    assert failing.mode is M.STOPPED


def test_a_refusal_is_forgotten_when_the_request_makes_sense_again() -> None:
    flying = machine(M.HOVERING)
    flying.step(R.FLY, frozenset())
    flying.step(R.ARM, frozenset())
    assert flying.reason == "refuses to arm while flying"
    flying.step(R.FLY, frozenset())
    assert flying.reason == "asked to fly"


def test_no_mode_but_stopped_is_a_dead_end() -> None:
    for mode in set(M) - {M.STOPPED}:
        following = {*REQUESTED[mode].values(), *HAPPENED.get(mode, {}).values()} - {mode}
        assert following
        assert M.STOPPED in following
