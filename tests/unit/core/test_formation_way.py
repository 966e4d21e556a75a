"""Ways around other vehicles: bounds by hand, whom they lead where, and when there is none."""

import math

import numpy as np

from relform_core.arrays import Array
from relform_core.blend import Blend
from relform_core.controller_config import FormationChangeConfig
from relform_core.formation_way import Separation, around, is_free, pairs, separations

LIMITS = FormationChangeConfig(speed_max_m_s=1.0, acceleration_max_m_s2=1.0)
SEPARATION = Separation(least=0.5, margin=0.1)


def straight(start: Array, target: Array, velocity: Array | None = None) -> Blend:
    at_rest = np.zeros_like(start) if velocity is None else velocity
    return Blend.within(start, at_rest, target, LIMITS.speed_max, LIMITS.acceleration_max)


def planned(start: list[list[float]], target: list[list[float]]) -> Blend:
    """A way on which the vehicles have to go around each other."""
    direct = straight(np.array(start), np.array(target))
    assert not is_free(direct, SEPARATION)
    way = around(direct, LIMITS, SEPARATION)
    assert way is not None
    return way


def closest(way: Blend) -> float:
    """Smallest distance of two vehicles at 4001 instants [m]."""
    path = way.at(np.linspace(0.0, way.duration, 4001))
    first, second = pairs(len(path))
    return float(np.linalg.norm(path[second] - path[first], axis=2).min())


def test_how_far_apart_by_hand() -> None:
    """Pairs 01, 02 and 12: 2 m, 0.6 m and 1.4 m at the start, 3 m, 0.9 m and 0.5 m at the target."""
    start = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.6, 0.0, 0.0]])
    target = np.array([[0.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.9, 0.0]])
    np.testing.assert_allclose(SEPARATION.needed(start, target), [0.6, 0.55, 0.6])
    np.testing.assert_allclose(SEPARATION.needed(start, start[[0, 2, 1]]), [0.55, 0.55, 0.6])
    np.testing.assert_allclose(Separation(0.5, 0.0).needed(start, target), 0.5)
    touching = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.4]])
    np.testing.assert_allclose(SEPARATION.needed(touching, touching), [0.5])


def test_distances_on_straight_ways_by_hand() -> None:
    """The first follower passes the leader 0.3 m ahead and 0.4 m above, the second one stays."""
    start = np.array([[0.0, 0.0, 0.0], [0.3, -2.0, 0.4], [-1.0, 0.0, 0.0]])
    target = np.array([[0.0, 0.0, 0.0], [0.3, 1.0, 0.4], [-1.0, 0.0, 0.0]])
    found = separations(straight(start, target))
    np.testing.assert_allclose(found, [0.5, 1.0, math.hypot(1.3, 0.4)])


def test_distances_on_curved_ways_are_never_overestimated() -> None:
    start = np.array([[0.0, 0.0, 0.0], [1.0, -2.0, 0.4], [-1.0, 0.5, -0.2]])
    target = np.array([[0.0, 0.0, 0.0], [1.2, 4.0, 0.1], [-2.0, 0.0, 0.3]])
    way = straight(start, target, np.array([[0.0, 0.0, 0.0], [-0.9, 0.3, 0.1], [0.4, -0.8, 0.2]]))
    assert closest(way) - 2e-3 < separations(way).min() <= closest(way)


def test_two_followers_change_places() -> None:
    places = [[0, 0, 0], [-1, -0.6, -0.5], [-1, 0.6, -0.5]]
    way = planned(places, [places[i] for i in (0, 2, 1)])
    assert 0.6 < closest(way) < 0.65
    first, second = way.at(np.array([0.5 * way.duration]))[1:, 0]
    np.testing.assert_allclose(first + second, [-2.0, 0.0, -1.0], atol=1e-6)
    assert first[0] > -0.7  # to its left it flies ahead, the other one behind
    assert way.duration < 1.5 * straight(way.start, way.target).duration


def test_three_followers_change_places_in_a_cycle() -> None:
    places = [[0, 0, 0], [-1, -0.5, 0.2], [-1.7, 0, -0.3], [-1, 0.5, 0], [-2.5, 1.5, 0]]
    way = planned(places, [places[i] for i in (0, 2, 3, 1, 4)])
    assert closest(way) > 0.6
    np.testing.assert_allclose(way.at(np.array([way.duration]))[:, 0], way.target, atol=1e-12)


def test_a_follower_passes_through_a_line_of_others() -> None:
    """They stand 0.9 m apart in its way; they make room, and come back."""
    line = [[-1, y, 0] for y in (-1.35, -0.45, 0.45, 1.35)]
    way = planned([[0, 0, 0], *line, [-3, 0.05, 0]], [[0, 0, 0], *line, [1.5, 0.1, 0]])
    assert closest(way) > 0.6
    np.testing.assert_allclose(way.at(np.array([way.duration]))[1:5, 0], line, atol=1e-12)


def test_along_a_column() -> None:
    column = [[-0.8 * number, 0, 0] for number in range(6)]
    way = planned(column, [column[i] for i in (0, 5, 2, 3, 4, 1)])
    assert closest(way) > 0.6


def test_above_and_below_the_leader() -> None:
    """Two followers pass it vertically, one upward and one downward, a third one crosses 0.3 m below it."""
    start = [[0, 0, 0], [0, 0, -1.5], [0.1, 0, 1.5], [-2, 0, -0.3]]
    target = [[0, 0, 0], [0, 0, 1.5], [0.1, 0, -1.5], [2, 0, -0.3]]
    way = planned(start, target)
    assert closest(way) > 0.6
    path = way.at(np.linspace(0.0, way.duration, 101))
    np.testing.assert_array_equal(path[0], 0.0)
    np.testing.assert_allclose(path[3, :, 2], -0.3)


def test_heights_are_those_of_the_straight_way() -> None:
    start = np.array([[0, 0, 0], [-1, -0.6, -0.9], [-1, 0.6, -0.5], [-1.6, 0.0, 0.4]])
    target = start[[0, 2, 3, 1]]
    way = planned(start.tolist(), target.tolist())
    direct = straight(start, target)
    share = np.linspace(0.0, 1.0, 50)
    heights = (each.at(share * each.duration)[:, :, 2] for each in (way, direct))
    np.testing.assert_allclose(*heights, atol=1e-12)


def test_vehicles_that_move_keep_their_velocities() -> None:
    """They fly towards each other when they are asked to change places."""
    start = np.array([[0, 0, 0], [-1, -0.8, 0], [-1, 0.9, 0]])
    velocity = np.array([[0, 0, 0], [0.2, 0.5, -0.1], [0, -0.4, 0.1]])
    direct = straight(start, np.array([[0, 0, 0], [-1.2, 0.9, 0], [-1, -0.7, 0.2]]), velocity)
    assert not is_free(direct, SEPARATION)
    way = around(direct, LIMITS, SEPARATION)
    assert way is not None
    np.testing.assert_allclose(way.velocity_at(np.array([0.0]))[:, 0], velocity, atol=1e-12)
    np.testing.assert_array_equal(way.velocity_at(np.array([way.duration]))[:, 0], np.zeros((3, 3)))
    assert closest(way) > 0.6


def test_places_at_the_collision_distance_leave_no_room() -> None:
    start = np.array([[0, 0, 0], [-1, -0.25, 0], [-1, 0.25, 0]])
    assert around(straight(start, start[[0, 2, 1]]), LIMITS, SEPARATION) is None


def test_the_same_way_is_found_again() -> None:
    column = [[-0.8 * number, 0, 0.05 * number] for number in range(5)]
    once, again = (planned(column, [column[i] for i in (0, 4, 3, 2, 1)]) for _ in range(2))
    assert once is again  # a request is checked, made and begun with one search
