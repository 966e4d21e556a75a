"""From a start anywhere into the formation: references of all pairs, by hand and from poses in the world."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_controller.ocp.layout import ordered_pairs
from relform_controller.ocp.problem import TeamGeometry
from relform_controller.reference.form_up import HALF_TURN_TIME, StartPoses, YawRamp, seen_by_turned
from relform_controller.reference.formation import FormationSchedule
from relform_core.errors import FlightError
from support.scenarios import paper_scenario

PERIOD_NS = 50_000_000
POSES = StartPoses(
    places=np.array([[0.0, 0.0, 0.0], [-1.2, -0.3, -0.6], [-0.9, 0.75, -0.4]]),
    yaws=np.radians([0.0, 170.0, -40.0]),
    p_NB_N=np.array([0.4, -0.3, 2.1]),
    yaw_NB=0.2,
)


def held() -> FormationSchedule:
    schedule = FormationSchedule(paper_scenario().config)
    schedule.hold(POSES)
    return schedule


def reference(schedule: FormationSchedule, step: int) -> np.ndarray:
    return schedule.reference(np.array([step * PERIOD_NS]))[:, 0]


def by_poses(places: np.ndarray, yaws: np.ndarray) -> np.ndarray:
    """What each vehicle sees of the others, with SciPy."""
    return np.array(
        [
            Rotation.from_euler("z", yaws[i]).inv().apply(places[j] - places[i])
            for i, j in ordered_pairs(len(places))
        ]
    )


def test_a_turned_observer_by_hand() -> None:
    """It looks left: what was 2 m ahead of the leader's heading is to its right."""
    seen = seen_by_turned(np.array([[[2.0, 0.5, -0.25]]]), np.array([[np.pi / 2]]))
    np.testing.assert_allclose(seen, [[[0.5, -2.0, -0.25]]], atol=1e-12)


def test_yaw_ramp_by_hand() -> None:
    ramp = YawRamp.to_zero(np.radians([0.0, -180.0, 45.0]))
    assert ramp.duration == pytest.approx(HALF_TURN_TIME)
    yaws = np.degrees(ramp.at(np.array([0.0, 0.25, 0.5, 1.0, 2.0]) * HALF_TURN_TIME))
    shares = np.array([1.0, 0.84375, 0.5, 0.0, 0.0])  # 1 - x^2 (3 - 2 x)
    np.testing.assert_allclose(yaws, np.outer([0.0, -180.0, 45.0], shares), atol=1e-9)
    assert YawRamp.to_zero(np.radians([0.0, 45.0])).duration == pytest.approx(HALF_TURN_TIME / 2)


def test_poses_come_from_what_the_leader_sees() -> None:
    pairs = ordered_pairs(3)
    geometry = TeamGeometry(
        p_I1I2_I1=np.arange(18.0).reshape(6, 3), yaw_I1I2=np.arange(6) / 10, p_NI_N=np.ones(3), yaw_NI=0.3
    )
    poses = StartPoses.seen_by_leader(geometry)
    assert pairs[:2] == ((0, 1), (0, 2))
    np.testing.assert_array_equal(poses.places, [[0, 0, 0], [0, 1, 2], [3, 4, 5]])
    np.testing.assert_array_equal(poses.yaws, [0.0, 0.0, 0.1])
    assert (poses.p_NB_N.tolist(), poses.yaw_NB) == ([1.0, 1.0, 1.0], 0.3)


def test_a_team_that_holds_its_place_is_asked_to_stay_as_it_is() -> None:
    schedule = held()
    ahead = schedule.reference(np.zeros(16, dtype=np.int64))
    np.testing.assert_allclose(ahead, np.tile(by_poses(POSES.places, POSES.yaws)[:, None], (1, 16, 1)))
    np.testing.assert_allclose(schedule.target[0], [-1.0, -0.5, -0.5])  # the formation that it will fly


def test_forming_up_starts_where_the_team_is_and_ends_in_the_formation() -> None:
    schedule = held()
    schedule.advance(0)
    np.testing.assert_allclose(reference(schedule, 0), by_poses(POSES.places, POSES.yaws), atol=1e-12)
    np.testing.assert_allclose(
        reference(schedule, 60), FormationSchedule(paper_scenario().config).target, atol=1e-12
    )
    pairs = {pair: k for k, pair in enumerate(ordered_pairs(3))}
    yaw_1 = [np.arctan2(*reference(schedule, step)[pairs[1, 0], 1::-1]) for step in range(61)]
    turned = np.unwrap(yaw_1)
    assert abs(np.degrees(turned[-1] - turned[0])) == pytest.approx(170.0, abs=30.0)  # the short way
    paths = np.array([reference(schedule, step)[:2] for step in range(61)])
    assert np.linalg.norm(np.diff(paths, axis=0), axis=2).max() / 0.05 < 1.0  # [m/s], the bound on changes


def test_a_request_before_the_start_is_what_the_team_forms_up_to() -> None:
    schedule = held()
    asked = {"follower_1": (-1.5, -0.75, 0.0), "follower_2": (-1.5, 0.75, 0.0)}
    schedule.check(asked)
    schedule.request(asked)
    schedule.advance(0)
    np.testing.assert_allclose(reference(schedule, 0), by_poses(POSES.places, POSES.yaws), atol=1e-12)
    np.testing.assert_allclose(reference(schedule, 80)[:2], list(asked.values()), atol=1e-12)


def test_followers_that_start_near_the_place_of_the_other_fly_around_each_other() -> None:
    schedule = FormationSchedule(paper_scenario().config)
    schedule.hold(replace(POSES, places=POSES.places[[0, 2, 1]]))  # each near the place of the other
    distances = []
    for step in range(121):
        schedule.advance(step * PERIOD_NS)
        distances.append(np.linalg.norm(reference(schedule, step)[3]))
    assert min(distances) > 0.6
    np.testing.assert_allclose(reference(schedule, 120), schedule.target, atol=1e-12)


def test_vehicles_that_start_too_close_are_refused() -> None:
    schedule = FormationSchedule(paper_scenario().config)
    places = POSES.places.copy()
    places[2] = places[1] + (0.1, 0.3, 0.2)
    schedule.hold(replace(POSES, places=places))
    message = "^the team cannot form up from where it is: 'follower_1' and 'follower_2' would come within 0.3"
    with pytest.raises(FlightError, match=message):
        schedule.advance(0)
