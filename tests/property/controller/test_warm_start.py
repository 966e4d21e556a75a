"""A plan in the next {mi} frames is the same plan: motion in the world, dynamics, relative positions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relform_controller.ocp import layout
from relform_controller.ocp.problem import Plan, TeamGeometry
from relform_controller.solver.warm_start import transform
from support.problems import Poses, Problem, random_problem, random_thrusts_of_team, simulate, simulated_plan
from support.world import Array

PAIRS = layout.ordered_pairs(3)
SHORT = "controller.horizon_steps=5"
seeds = st.integers(0, 2**32 - 1)


def moved_plan(seed: int) -> tuple[Problem, Plan]:
    """A plan that starts anywhere in its {mi} frames, as the second step of another plan does."""
    problem = random_problem(seed, 3, SHORT)
    states = problem.initial_states.copy()
    generator = np.random.default_rng(seed)
    states[:, layout.POSITION] = generator.uniform(-0.5, 0.5, (3, 3))
    states[:, layout.YAW] = generator.uniform(-3.0, 3.0, 3)
    thrusts = random_thrusts_of_team(seed, problem.ocp, problem.config.vehicle.hover_thrust)
    return problem, simulated_plan(problem, thrusts, states)


def in_world(plan: Plan, poses: Poses) -> tuple[Array, Array, Array]:
    """Positions and velocities, shape (vehicle, stage, 3), and yaws, shape (vehicle, stage)."""
    R_NI = [poses.levelled(vehicle) for vehicle in range(len(plan.states))]
    p_IB_I, v_IB_I = plan.states[..., layout.POSITION], plan.states[..., layout.VELOCITY]
    p_NB_N = np.array([R.apply(p) + origin for R, p, origin in zip(R_NI, p_IB_I, poses.p_NI_N, strict=True)])
    v_NB_N = np.array([R.apply(v) for R, v in zip(R_NI, v_IB_I, strict=True)])
    return p_NB_N, v_NB_N, plan.states[..., layout.YAW] + poses.yaw_NI[:, None]


def assert_same_angles(a: Array, b: Array) -> None:
    np.testing.assert_allclose(np.exp(1j * a), np.exp(1j * b), atol=1e-9)


def relative_positions(plan: Plan, geometry: TeamGeometry) -> Array:
    """p_B1B2_C1 of all pairs and stages, the horizontal part by complex numbers; shape (pair, stage, 3)."""
    p, yaw = plan.states[..., layout.POSITION], plan.states[..., layout.YAW]
    z = p[..., 0] + 1j * p[..., 1]
    found = []
    for pair, (i, j) in enumerate(PAIRS):
        x, y, up = geometry.p_I1I2_I1[pair]
        horizontal = np.exp(-1j * yaw[i]) * (x + 1j * y + np.exp(1j * geometry.yaw_I1I2[pair]) * z[j] - z[i])
        found.append(np.stack([horizontal.real, horizontal.imag, up + p[j, :, 2] - p[i, :, 2]], axis=-1))
    return np.array(found)


@given(seed=seeds)
def test_next_frames_are_where_the_bodies_are(seed: int) -> None:
    problem, plan = moved_plan(seed)
    _, geometry = transform(plan, problem.poses.geometry(), PAIRS)
    p_NB_N, _, yaw_NB = in_world(plan, problem.poses)
    expected = Poses(p_NB_N[:, 0], yaw_NB[:, 0]).geometry()
    np.testing.assert_allclose(geometry.p_I1I2_I1, expected.p_I1I2_I1, atol=1e-9)
    assert_same_angles(geometry.yaw_I1I2, expected.yaw_I1I2)
    np.testing.assert_allclose(geometry.p_NI_N, expected.p_NI_N, atol=1e-9)
    assert geometry.yaw_NI == pytest.approx(expected.yaw_NI)  # continuous, not wrapped


@given(seed=seeds)
def test_motion_in_the_world_stays_the_same(seed: int) -> None:
    problem, plan = moved_plan(seed)
    transformed, _ = transform(plan, problem.poses.geometry(), PAIRS)
    p_NB_N, v_NB_N, yaw_NB = in_world(plan, problem.poses)
    next_poses = Poses(p_NB_N[:, 0], yaw_NB[:, 0])
    p_NB_N__next, v_NB_N__next, yaw_NB__next = in_world(transformed, next_poses)
    np.testing.assert_allclose(p_NB_N__next, p_NB_N, atol=1e-9)
    np.testing.assert_allclose(v_NB_N__next, v_NB_N, atol=1e-9)
    np.testing.assert_allclose(yaw_NB__next, yaw_NB, atol=1e-9)
    tilt_and_rates = [layout.ROLL, layout.PITCH, *range(layout.N_STATE)[layout.RATE]]
    np.testing.assert_array_equal(transformed.states[..., tilt_and_rates], plan.states[..., tilt_and_rates])
    np.testing.assert_array_equal(transformed.thrusts, plan.thrusts)
    assert not transformed.states[:, 0, layout.POSITION].any()
    assert not transformed.states[:, 0, layout.YAW].any()


@given(seed=seeds)
def test_a_transformed_plan_obeys_the_dynamics(seed: int) -> None:
    problem, plan = moved_plan(seed)
    transformed, _ = transform(plan, problem.poses.geometry(), PAIRS)
    simulated = simulate(problem.ocp, transformed.states[:, 0], transformed.thrusts)
    np.testing.assert_allclose(transformed.states, simulated, atol=1e-9)


@given(seed=seeds)
def test_relative_positions_stay_the_same_even_if_they_do_not_fit_each_other(seed: int) -> None:
    problem, plan = moved_plan(seed)
    generator = np.random.default_rng(seed)
    geometry = problem.poses.geometry()
    raw = TeamGeometry(
        geometry.p_I1I2_I1 + generator.normal(0.0, 0.1, geometry.p_I1I2_I1.shape),
        geometry.yaw_I1I2 + generator.normal(0.0, 0.2, geometry.yaw_I1I2.shape),
        geometry.p_NI_N,
        geometry.yaw_NI,
    )
    before = relative_positions(plan, raw)
    after = relative_positions(*transform(plan, raw, PAIRS))
    np.testing.assert_allclose(after, before, atol=1e-9)


@given(seed=seeds)
def test_transforming_again_does_not_change_the_plan(seed: int) -> None:
    """The plan starts at the origin of its frames already."""
    problem, plan = moved_plan(seed)
    once, geometry = transform(plan, problem.poses.geometry(), PAIRS)
    twice, again = transform(once, geometry, PAIRS)
    np.testing.assert_allclose(twice.states, once.states, atol=1e-12)
    np.testing.assert_allclose(again.p_I1I2_I1, geometry.p_I1I2_I1, atol=1e-12)
    assert again.yaw_NI == geometry.yaw_NI
