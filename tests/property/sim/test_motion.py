"""The motion in C is that of the reference, bit for bit."""

import dataclasses
import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import relform_sim.plant
from relform_sim import motion_kernel
from relform_sim.contact import Legs
from relform_sim.motion import Inputs, Motion, ReferenceMotion
from relform_sim.motion_kernel import CompiledMotion, make_motion
from support.bodies import BODY
from support.flights import AGILE, all_speeds, record
from support.scenarios import paper_scenario

DRAGGED = dataclasses.replace(BODY, drag_coefficient=(0.3, 0.2, 0.1))
ON_LEGS = dataclasses.replace(DRAGGED, legs=Legs.under(BODY.mass, BODY.inertia, BODY.arm_length, 0.1))


def numbers(count: int, size: float) -> st.SearchStrategy[tuple[float, ...]]:
    return st.tuples(*[st.floats(-size, size) for _ in range(count)])


speeds = st.tuples(*[st.floats(0.0, 900.0) for _ in range(4)])
quaternions = numbers(4, 1.0).filter(lambda q: math.hypot(*q) > 0.1)


def bits(values: tuple[float, ...]) -> bytes:
    return struct.pack(f"{len(values)}d", *values)


@given(
    step=st.floats(1e-4, 0.02),
    lag=st.one_of(st.just(0.0), st.floats(1e-3, 0.2)),
    n_steps=st.integers(0, 20),
    moving=numbers(6, 50.0),
    q_NB=quaternions,
    w_NB_B=numbers(3, 30.0),
    before=speeds,
    commanded=speeds,
    wind_N=numbers(3, 5.0),
    thrust_scale=st.floats(0.0, 2.0),
    rotor_scales=st.tuples(*[st.floats(0.0, 1.0) for _ in range(4)]),
)
def test_equal_to_the_last_bit(
    step: float,
    lag: float,
    n_steps: int,
    moving: tuple[float, ...],
    q_NB: tuple[float, ...],
    w_NB_B: tuple[float, ...],
    before: tuple[float, ...],
    commanded: tuple[float, ...],
    wind_N: tuple[float, float, float],
    thrust_scale: float,
    rotor_scales: tuple[float, ...],
) -> None:
    length = math.hypot(*q_NB)
    state = (*moving, *(each / length for each in q_NB), *w_NB_B)
    inputs = Inputs(before, commanded, wind_N, thrust_scale, rotor_scales)
    compiled, reference = (
        kind(DRAGGED, step, lag).after(n_steps, state, inputs) for kind in (CompiledMotion, ReferenceMotion)
    )
    assert bits(compiled) == bits(reference)


@given(
    height=st.floats(0.0, 0.25),
    velocity=numbers(3, 2.0),
    q_NB=quaternions,
    tilt=st.floats(0.0, 1.0),
    w_NB_B=numbers(3, 3.0),
    commanded=speeds,
    wind_N=numbers(3, 2.0),
)
def test_equal_on_the_ground(
    height: float,
    velocity: tuple[float, ...],
    q_NB: tuple[float, ...],
    tilt: float,
    w_NB_B: tuple[float, ...],
    commanded: tuple[float, ...],
    wind_N: tuple[float, float, float],
) -> None:
    """Any yaw, and a tilt between none and any, over what a vehicle does in one control period."""
    tilted = (tilt * q_NB[0], tilt * q_NB[1], q_NB[2], q_NB[3] + 0.2)
    length = math.hypot(*tilted) or 1.0
    state = (0.4, -0.7, height, *velocity, *(each / length for each in tilted), *w_NB_B)
    inputs = Inputs((150.0,) * 4, commanded, wind_N, 1.0)
    compiled, reference = (
        kind(ON_LEGS, 0.005, 0.03).after(10, state, inputs) for kind in (CompiledMotion, ReferenceMotion)
    )
    assert bits(compiled) == bits(reference)


@given(velocity=numbers(3, 5.0), q_NB=quaternions, commanded=speeds)
def test_legs_in_the_air_change_nothing(
    velocity: tuple[float, ...], q_NB: tuple[float, ...], commanded: tuple[float, ...]
) -> None:
    length = math.hypot(*q_NB)
    state = (0.4, -0.7, 1.5, *velocity, *(each / length for each in q_NB), 0.3, -0.2, 0.1)
    inputs = Inputs(commanded, commanded, (0.1, 0.2, -0.3), 1.0)
    with_legs, without = (
        CompiledMotion(body, 0.005, 0.0).after(10, state, inputs) for body in (ON_LEGS, DRAGGED)
    )
    assert bits(with_legs) == bits(without)


@pytest.mark.parametrize("lag", [0.0, 0.04])
def test_a_motion_that_diverges_is_the_same_until_it_is_no_number(lag: float) -> None:
    state = (1.0, 2.0, 3.0, 1e150, -1e120, 0.0, 0.1, 0.2, 0.3, math.sqrt(0.86), 1e140, -1e100, 2.0)
    inputs = Inputs((500.0,) * 4, (430.0, 440.0, 450.0, 460.0), (0.3, -0.2, 0.1), 0.9)
    found = [state, state]
    motions: list[Motion] = [CompiledMotion(DRAGGED, 0.005, lag), ReferenceMotion(BODY, 0.005, lag)]
    for _ in range(5):
        found = [motion.after(1, each, inputs) for motion, each in zip(motions, found, strict=True)]
        np.testing.assert_array_equal(*found)
    assert not np.isfinite(found[0]).all()


def test_without_a_compiler_there_is_a_warning_and_the_reference(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(motion_kernel, "_library", motion_kernel._library.__wrapped__)  # nothing loaded yet
    with pytest.warns(RuntimeWarning, match="no C compiler found"):
        assert isinstance(make_motion(DRAGGED, 0.005, 0.0), ReferenceMotion)


def test_a_flight_is_the_same_with_and_without_a_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = paper_scenario(AGILE, "plant.rotor_time_constant_s=0.03", seed=4)
    _, with_compiler = record(scenario, 25)
    monkeypatch.setattr(relform_sim.plant, "make_motion", ReferenceMotion)
    _, without = record(scenario, 25)
    np.testing.assert_array_equal(all_speeds(with_compiler), all_speeds(without))
