"""The first guess of a flight, and the plan one period later."""

import dataclasses
import math

import numpy as np
import pytest

from relform_controller.ocp import layout
from relform_controller.ocp.problem import Plan, TeamGeometry
from relform_controller.ocp.rotor_lag import RotorLag, Rotors
from relform_controller.solver.prediction import predictor
from relform_controller.solver.warm_start import hover_plan, shift, transform
from support.problems import (
    mean_thrusts,
    random_problem,
    random_thrusts_of_team,
    simulate,
    simulated_plan,
)
from support.world import Array


def test_first_guess_stays_where_it_is() -> None:
    problem = random_problem(3, 3)
    plan = hover_plan(problem.start, hover_thrust=1.75, n_stages=4)
    assert plan.thrusts.shape == (3, 4, layout.N_INPUT)
    assert (plan.thrusts == 1.75).all()
    np.testing.assert_array_equal(plan.states, np.stack([problem.initial_states] * 5, axis=1))
    np.testing.assert_array_equal(plan.rotors.thrusts, problem.rotor_thrusts)


def test_shifted_plan_is_one_period_on_and_ends_with_the_last_input_again() -> None:
    problem = random_problem(2, 3, "controller.horizon_steps=6")
    thrusts = random_thrusts_of_team(2, problem.ocp, problem.config.vehicle.hover_thrust)
    plan = simulated_plan(problem, thrusts)
    shifted = shift(plan, predictor(problem.ocp), problem.ocp)
    np.testing.assert_array_equal(shifted.thrusts[:, :-1], thrusts[:, 1:])
    np.testing.assert_array_equal(shifted.thrusts[:, -1], thrusts[:, -1])
    np.testing.assert_array_equal(shifted.states[:, :-1], plan.states[:, 1:])
    extended = np.concatenate([thrusts, thrusts[:, -1:]], axis=1)
    expected = simulate(problem.ocp, problem.initial_states, extended)
    np.testing.assert_allclose(shifted.states, expected[:, 1:], atol=1e-12)


@pytest.mark.parametrize("stage_s", [0.05, 0.08])
def test_a_shifted_plan_continues_the_lag_of_the_rotors(stage_s: float) -> None:
    """The states and thrusts are those one period later of the same flight, at every stage."""
    overrides = ("vehicle.rotor_time_constant_s=0.04", f"controller.stage_s={stage_s}")
    problem = random_problem(4, 3, "controller.horizon_steps=6", *overrides)
    ocp, period = problem.ocp, 0.05
    commands = random_thrusts_of_team(4, ocp, problem.config.vehicle.hover_thrust)
    plan = simulated_plan(problem, commands)
    shifted = shift(plan, predictor(ocp), ocp)

    def following(rotor_thrusts: Array, command: Array, duration: float) -> Array:
        return command + math.exp(-duration / 0.04) * (rotor_thrusts - command)

    rotor_thrusts, one_period = problem.rotor_thrusts, dataclasses.replace(ocp, stage=period)
    np.testing.assert_allclose(shifted.rotors.thrusts, following(rotor_thrusts, commands[:, 0], period))
    for stage in range(ocp.n_stages + 1):
        command = commands[:, min(stage, ocp.n_stages - 1)]
        means = mean_thrusts(0.04, period, command[:, None], rotor_thrusts)
        expected = simulate(one_period, plan.states[:, stage], means)[:, 1]
        np.testing.assert_allclose(shifted.states[:, stage], expected, atol=1e-12)
        rotor_thrusts = following(rotor_thrusts, command, stage_s)


def test_the_plan_that_was_shifted_and_transformed_is_not_touched() -> None:
    problem = random_problem(2, 3, "controller.horizon_steps=6")
    thrusts = random_thrusts_of_team(2, problem.ocp, problem.config.vehicle.hover_thrust)
    plan = simulated_plan(problem, thrusts)
    copy = Plan(plan.states.copy(), plan.thrusts.copy(), plan.rotors)
    geometry = problem.poses.geometry()
    transform(shift(plan, predictor(problem.ocp), problem.ocp), geometry, problem.ocp.pairs)
    np.testing.assert_array_equal(plan.states, copy.states)
    np.testing.assert_array_equal(plan.thrusts, copy.thrusts)
    np.testing.assert_array_equal(geometry.p_I1I2_I1, problem.poses.geometry().p_I1I2_I1)


def test_a_quarter_turn_by_hand() -> None:
    """1 moves 1 m ahead and turns left by 90 deg; 2, 3 m ahead with equal yaw, moves 1 m to the left."""
    states = np.zeros((2, 1, layout.N_STATE))
    states[0, 0, layout.POSITION], states[0, 0, layout.YAW] = [1.0, 0.0, 0.0], np.pi / 2
    states[0, 0, layout.VELOCITY] = [0.0, 2.0, 0.5]
    states[1, 0, layout.POSITION] = [0.0, 1.0, 0.2]
    geometry = TeamGeometry(
        p_I1I2_I1=np.array([[3.0, 0.0, 0.5], [-3.0, 0.0, -0.5]]),
        yaw_I1I2=np.zeros(2),
        p_NI_N=np.array([10.0, 20.0, 30.0]),
        yaw_NI=np.pi,
    )
    plan, found = transform(
        Plan(states, np.ones((2, 0, 4)), Rotors(RotorLag(0.0), np.ones((2, 4)))), geometry, ((0, 1), (1, 0))
    )
    np.testing.assert_allclose(plan.states[0, 0, layout.VELOCITY], [2.0, 0.0, 0.5], atol=1e-12)  # ahead
    # From 1, 2 is 2 m ahead and 1 m left in the old frame: 1 m ahead and 2 m to the right in the new one.
    np.testing.assert_allclose(found.p_I1I2_I1, [[1.0, -2.0, 0.7], [-2.0, -1.0, -0.7]], atol=1e-12)
    np.testing.assert_allclose(found.yaw_I1I2, [-np.pi / 2, np.pi / 2])
    # The leader looked back along x: 1 m ahead is at 9 m.
    np.testing.assert_allclose(found.p_NI_N, [9.0, 20.0, 30.0], atol=1e-12)
    assert found.yaw_NI == 1.5 * np.pi


@pytest.mark.parametrize("stage_s", [0.05, 0.08, 0.1, 0.25])
def test_a_shift_by_a_part_of_a_stage(stage_s: float) -> None:
    """The states are those of the old inputs, and the thrust keeps its mean over each new stage."""
    problem = random_problem(5, 3, f"controller.stage_s={stage_s}", "controller.horizon_steps=6")
    ocp, share = problem.ocp, 0.05 / stage_s
    thrusts = random_thrusts_of_team(5, ocp, problem.config.vehicle.hover_thrust)
    plan = simulated_plan(problem, thrusts)
    shifted = shift(plan, predictor(ocp), ocp)
    for stage in range(ocp.n_stages + 1):
        held = thrusts[:, min(stage, ocp.n_stages - 1)]
        expected = simulate(dataclasses.replace(ocp, stage=0.05), plan.states[:, stage], held[:, None])[:, 1]
        np.testing.assert_allclose(shifted.states[:, stage], expected, atol=1e-12)
    following = np.concatenate([thrusts[:, 1:], thrusts[:, -1:]], axis=1)
    np.testing.assert_allclose(shifted.thrusts, (1.0 - share) * thrusts + share * following)
