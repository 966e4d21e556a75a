"""Where the vehicles start: in formation, or displaced and turned at random within bounds."""

import math

import numpy as np
import pytest

from relform_core.errors import ConfigError, FlightError
from relform_core.scenario_config import ScenarioConfig
from relform_sim.start import CLEARANCE, start_poses
from relform_sim.vehicle import Vehicle
from support.scenarios import FROM_GROUND, paper_scenario, team_of

TURNED = ("start.position_m=[3.0, -1.0, 2.0]", "start.yaw_deg=90.0")
DRAWN = ("start.follower_yaw_max_deg=120.0", "start.follower_offset_max_m=0.3")
SEEDS = range(200)


def config_with(*overrides: str) -> ScenarioConfig:
    return paper_scenario(*TURNED, *overrides).config


def test_a_team_starts_in_formation_by_default() -> None:
    poses = start_poses(config_with(), seed=4)
    assert list(poses) == ["leader", "follower_1", "follower_2"]
    np.testing.assert_allclose(poses["leader"].p_NB_N, [3.0, -1.0, 2.0])
    np.testing.assert_allclose(poses["follower_1"].p_NB_N, [3.5, -2.0, 1.5])  # (-1, -0.5, -0.5) turned left
    assert {pose.yaw for pose in poses.values()} == {math.pi / 2}


def test_draws_fill_their_bounds_and_leave_the_leader_alone() -> None:
    in_formation = start_poses(config_with(), seed=0)
    offsets, turns = [], []
    for seed in SEEDS:
        poses = start_poses(config_with(*DRAWN), seed)
        assert poses["leader"] == in_formation["leader"]
        for name in ("follower_1", "follower_2"):
            offsets.append(np.subtract(poses[name].p_NB_N, in_formation[name].p_NB_N))
            turns.append(poses[name].yaw - math.pi / 2)
    distances = np.linalg.norm(offsets, axis=1)
    assert 0.28 < distances.max() <= 0.3
    assert np.median(distances) == pytest.approx(0.3 * 0.5 ** (1 / 3), abs=0.02)  # uniform in the ball
    np.testing.assert_allclose(np.mean(offsets, axis=0), 0.0, atol=0.02)
    assert np.radians(115.0) < np.abs(turns).max() <= np.radians(120.0)
    assert abs(np.mean(turns)) < np.radians(15.0)


def test_the_same_seed_gives_the_same_start_and_another_seed_another() -> None:
    first, again, other = (start_poses(config_with(*DRAWN), seed) for seed in (1, 1, 2))
    assert first == again
    assert first["follower_1"] != other["follower_1"]


def test_each_vehicle_starts_at_its_pose() -> None:
    config = config_with(*DRAWN)
    for name, pose in start_poses(config, seed=3).items():
        truth = Vehicle(config, seed=3, name=name).advance(0, None)
        np.testing.assert_array_equal(truth.p_NB_N, pose.p_NB_N)
        np.testing.assert_allclose(truth.q_NB, [0.0, 0.0, math.sin(pose.yaw / 2), math.cos(pose.yaw / 2)])


def test_no_two_vehicles_start_too_close_to_each_other() -> None:
    config = config_with("start.follower_offset_max_m=0.9", *team_of(5))
    needed = CLEARANCE * config.vehicle.separation_min
    for seed in range(20):
        points = [pose.p_NB_N for pose in start_poses(config, seed).values()]
        assert min(math.dist(a, b) for k, a in enumerate(points) for b in points[:k]) >= needed


def test_a_start_without_a_free_place_is_refused() -> None:
    """The place itself is less than the clearance away from the leader, and so is all around it."""
    places = "{follower_1: [-0.51, 0.0, 0.0], follower_2: [-5.0, 0.0, 0.0]}"
    near = f"formations_m={{initial: {places}, wide: {places}}}"
    message = (
        r"^no start for 'follower_1': none of 1000 points within 0\.02 m of its place "
        r"\(start\.follower_offset_max_m\) is 0\.55 m or more away from the vehicles before it$"
    )
    with pytest.raises(FlightError, match=message):
        start_poses(config_with(near, "start.follower_offset_max_m=0.02"), seed=0)


def test_an_offset_to_the_ground_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"start\.position_m puts a vehicle at -0\.100 m above ground"):
        paper_scenario("start.follower_offset_max_m=1.6")


def test_with_ground_all_start_below_their_places_and_take_off_to_their_heights() -> None:
    config = config_with(FROM_GROUND)
    poses = start_poses(config, seed=4)
    np.testing.assert_allclose(poses["leader"].p_NB_N, [3.0, -1.0, 0.1])
    np.testing.assert_allclose(poses["follower_1"].p_NB_N, [3.5, -2.0, 0.1])
    assert [place[2] for place in config.start_places.values()] == [2.0, 1.5, 1.5]
    assert {pose.yaw for pose in poses.values()} == {math.pi / 2}


def test_with_ground_drawn_places_are_far_enough_apart_to_take_off() -> None:
    config = config_with(FROM_GROUND, "start.follower_offset_max_m=0.9", *team_of(5))
    for seed in range(20):
        points = [pose.p_NB_N for pose in start_poses(config, seed).values()]
        assert {z for _, _, z in points} == {config.vehicle.leg_height}
        assert min(math.dist(a, b) for k, a in enumerate(points) for b in points[:k]) >= 0.8
