"""The geofence: where points leave it, in words, and the nearest place inside for a whole team."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from relform_core.geofence_config import GeofenceConfig

FENCE = GeofenceConfig(x_m=(-5.0, 20.0), y_m=(-3.0, 4.0), height_max_m=6.0, margin_m=0.5)


@pytest.mark.parametrize(
    ("place", "margin", "breach"),
    [
        ((19.9, 3.9, 5.9), 0.0, None),
        ((0.0, 0.0, -0.2), 0.0, None),  # the ground is no side of it
        ((20.25, 0.0, 2.0), 0.0, "x = 20.25 m, at most 20.00 m (geofence.x_m)"),
        ((0.0, -3.5, 2.0), 0.0, "y = -3.50 m, at least -3.00 m (geofence.y_m)"),
        ((0.0, 4.1, 7.0), 0.0, "z = 7.00 m, at most 6.00 m (geofence.height_max_m)"),
        ((-4.75, 0.0, 2.0), 0.5, "x = -4.75 m, at least -4.50 m (geofence.x_m)"),
        ((0.0, 3.8, 2.0), np.array([0.0, 0.3, 9.0]), "z = 2.00 m, at most -3.00 m (geofence.height_max_m)"),
    ],
)
def test_where_a_point_leaves_it(place: tuple[float, ...], margin: float, breach: str | None) -> None:
    assert FENCE.breach(np.array(place), margin) == breach


def test_the_worst_of_many_points_is_named() -> None:
    way = np.array([[[19.0, 0.0, 2.0], [20.5, 0.0, 2.0]], [[21.5, 0.0, 2.0], [0.0, 5.0, 2.0]]])
    assert FENCE.breach(way) == "x = 21.50 m, at most 20.00 m (geofence.x_m)"


coordinates = st.tuples(*[st.floats(-40.0, 40.0)] * 3).map(np.array)
around = st.lists(st.tuples(*[st.floats(-1.5, 1.5)] * 3), min_size=0, max_size=4)


@given(place=coordinates, others=around)
def test_inside_is_inside_for_all_vehicles_and_changes_nothing_that_is(
    place: np.ndarray, others: list[tuple[float, float, float]]
) -> None:
    team = np.array([(0.0, 0.0, 0.0), *others])
    found = FENCE.inside(place, team)
    assert FENCE.breach(found + team, FENCE.margin - 1e-9) is None
    if FENCE.breach(place + team, FENCE.margin) is None:
        np.testing.assert_array_equal(found, place)
    moved = np.flatnonzero(found != place)
    assert FENCE.inside(found, team) == pytest.approx(found)
    for axis in moved:  # no farther than needed
        back = found.copy()
        back[axis] += 1e-6 * np.sign(place[axis] - found[axis])
        assert FENCE.breach(back + team, FENCE.margin) is not None


def test_a_team_that_does_not_fit_stays() -> None:
    place = np.array([30.0, 9.0, 2.0])
    np.testing.assert_array_equal(FENCE.inside(place, np.array([[0.0, -4.0, 0.0], [0.0, 4.0, 0.0]])), place)


@pytest.mark.parametrize(
    ("keys", "problem"),
    [
        ({"x_m": (1.0, 1.5)}, r"x_m \[1, 1.5\] has no room within margin_m 0.3 on both sides"),
        ({"y_m": (2.0, -2.0)}, r"y_m \[2, -2\] has no room within margin_m 0.3 on both sides"),
        ({"height_max_m": 0.25}, "height_max_m 0.25 must be more than margin_m 0.3"),
    ],
)
def test_a_fence_without_room_is_refused(keys: dict[str, object], problem: str) -> None:
    good = {"x_m": (-5.0, 5.0), "y_m": (-5.0, 5.0), "height_max_m": 4.0}
    with pytest.raises(ValidationError, match=problem):
        GeofenceConfig.model_validate(good | keys)
