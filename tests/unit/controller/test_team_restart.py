"""A belief that has proved wrong: a vehicle placed again, and a team without anchor in the world."""

import numpy as np

from relform_controller.estimation import team_model, team_noise
from relform_controller.estimation.team_belief import Belief
from relform_controller.estimation.team_geometry import covariances, states_and_geometry
from relform_controller.estimation.team_restart import placed_again, unanchored
from relform_controller.ocp import layout
from relform_controller.ocp.frames import rotation_z
from relform_controller.ocp.model import RigidBody
from relform_core.arrays import Array
from relform_core.sensors.range_bearing import RangeBearing
from support.scenarios import paper_scenario
from support.states import random_state

N, SIZE = 3, 3 * team_model.N_FILTER_STATE


def random_belief(seed: int) -> Belief:
    generator = np.random.default_rng(seed)
    states = np.ones((N, team_model.N_FILTER_STATE))
    states[:, : layout.N_STATE] = [random_state(generator, tilt_max=0.3) for _ in range(N)]
    states[:, team_model.DISTURBANCE] = generator.normal(size=(N, 3))
    return Belief(states, 0.01 * np.eye(SIZE) + 1e-3 * generator.normal(size=(SIZE, SIZE)))


def sighting(belief: Belief, observer: int, target: int) -> RangeBearing:
    """What the observer sees if the belief is true, by the filter's own model (tested elsewhere)."""
    seen, *_ = team_model.sighting()(belief.states[observer], belief.states[target])
    distance, azimuth, elevation = np.array(seen)[:, 0].tolist()
    return RangeBearing("", distance, azimuth, elevation, 1e-4 * np.eye(3))


def test_a_vehicle_is_placed_where_the_sightings_say() -> None:
    truth = random_belief(1)
    states = truth.states.copy()
    states[2, layout.POSITION] += [2.0, -3.0, 0.5]
    states[2, layout.YAW] += 2.4
    states[2, layout.VELOCITY] = rotation_z(2.4) @ states[2, layout.VELOCITY]
    found = placed_again(Belief(states, truth.factor), 1, 2, sighting(truth, 1, 2), sighting(truth, 2, 1))
    assert found is not None
    pose = [*range(3), *range(12)[layout.VELOCITY], layout.YAW]
    np.testing.assert_allclose(found.states[2][pose], truth.states[2][pose], atol=1e-9)
    np.testing.assert_array_equal(found.states[:2], truth.states[:2])


def test_a_vehicle_placed_again_is_known_relative_to_the_one_that_sees_it() -> None:
    truth = random_belief(2)
    found = placed_again(truth, 0, 2, sighting(truth, 0, 2), sighting(truth, 2, 0))
    assert found is not None
    assert np.linalg.eigvalsh(found.covariance).min() > 0.0
    _, geometry = states_and_geometry(found)
    pair = layout.ordered_pairs(N).index((0, 2))
    expected = np.diag([*team_noise.RESTART[layout.POSITION] ** 2, team_noise.RESTART[layout.YAW] ** 2])
    np.testing.assert_allclose(covariances(found, geometry).pairs[pair], expected, atol=1e-12)


def test_a_vehicle_straight_above_cannot_be_placed() -> None:
    truth = random_belief(3)
    truth.states[:, layout.RPY] = 0.0
    truth.states[2, layout.POSITION] = truth.states[0, layout.POSITION] + [0.0, 0.0, 1.5]
    assert placed_again(truth, 0, 2, sighting(truth, 0, 2), sighting(truth, 2, 0)) is None


def test_without_anchor_only_the_place_in_the_world_is_unknown() -> None:
    before = random_belief(4)
    after = unanchored(before)
    _, geometry = states_and_geometry(before)
    was, now = covariances(before, geometry), covariances(after, geometry)
    np.testing.assert_allclose(now.pairs, was.pairs, rtol=1e-6, atol=1e-9)
    added = np.diag(now.leader - was.leader)
    np.testing.assert_allclose(
        added, [*3 * [team_noise.UNANCHORED_POSITION**2], team_noise.UNANCHORED_YAW**2], rtol=1e-6
    )


def test_without_anchor_the_team_turns_as_a_rigid_body() -> None:
    """A small turn of the whole team about the leader is one of the new deviations."""
    before = random_belief(5)
    added = unanchored(before).covariance - before.covariance
    turn = 1e-6
    leader = before.states[0, layout.POSITION]

    def turned(state: Array) -> Array:
        state, R = state.copy(), rotation_z(turn)
        state[layout.POSITION] = leader + R @ (state[layout.POSITION] - leader)
        state[layout.VELOCITY] = R @ state[layout.VELOCITY]
        state[team_model.DISTURBANCE] = R @ state[team_model.DISTURBANCE]
        state[layout.YAW] += turn
        return state

    direction = (np.array([turned(state) for state in before.states]) - before.states).reshape(-1) / turn
    without_shift = added.copy()
    shift = np.zeros((N, team_model.N_FILTER_STATE, 3))
    shift[:, layout.POSITION] = team_noise.UNANCHORED_POSITION * np.eye(3)
    without_shift -= shift.reshape(-1, 3) @ shift.reshape(-1, 3).T
    expected = team_noise.UNANCHORED_YAW**2 * np.outer(direction, direction)
    np.testing.assert_allclose(without_shift, expected, atol=1e-5)


def test_a_change_has_moved_its_vehicle_before_it_was_seen() -> None:
    """The deviations are those of the model: of one interval with another disturbance or thrust scale."""
    body = RigidBody.from_config(paper_scenario().config.vehicle)
    state, thrusts = random_belief(7).states[1], np.array([1.6, 1.9, 1.5, 2.1])
    state[layout.RATE] = 0.0
    states = np.array([state, state])
    forces, torques = np.array([False, True]), np.array([True, False])
    columns = team_noise.changes(states, forces, torques, np.full(2, thrusts.sum() / body.mass), 0.05)
    assert columns.shape == (2 * team_model.N_FILTER_STATE, 7)
    assert np.flatnonzero(columns[: team_model.N_FILTER_STATE].any(axis=1)).tolist() == [9, 10, 11]
    transition = team_model.transition(body)
    for column in columns[team_model.N_FILTER_STATE :, :4].T:
        changed = state.copy()
        changed[12:16] += 1e-3 * column[12:16]
        moved, base = (np.array(transition(each, thrusts, 0.05)[0])[:, 0] for each in (changed, state))
        np.testing.assert_allclose((moved - base)[:6] / 1e-3, column[:6], atol=2e-3)
