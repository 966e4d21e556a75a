"""Ways between random formations: apart by the bound, within the limits, and exactly at the target.

In rare dense formations none is found, and the change is refused; hypothesis fails if that happens often.
"""

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from relform_core.arrays import Array
from relform_core.blend import Blend
from relform_core.controller_config import FormationChangeConfig
from relform_core.formation_way import Separation, around, is_free, pairs

SEPARATION = Separation(least=0.5, margin=0.1)
CELLS = [(x, y, z) for x in range(-3, 2) for y in range(-2, 3) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)]


@st.composite
def formations(draw: st.DrawFn, n_vehicles: int) -> Array:
    """Places 0.75 m apart or more, the leader's own first; often in lines and layers [m]."""
    cells = draw(
        st.lists(st.sampled_from(CELLS), min_size=n_vehicles - 1, max_size=n_vehicles - 1, unique=True)
    )
    shifts = st.sampled_from([0.0, 0.0, -0.12, 0.05, 0.12])
    shift = draw(st.lists(st.tuples(shifts, shifts, shifts), min_size=len(cells), max_size=len(cells)))
    return np.array([(0.0, 0.0, 0.0), *(np.array(cells) + np.array(shift)).tolist()])


two_formations = st.integers(3, 8).flatmap(lambda n: st.tuples(formations(n), formations(n)))
limits = st.builds(
    lambda speed, acceleration: FormationChangeConfig(
        speed_max_m_s=speed, acceleration_max_m_s2=acceleration, margin_m=SEPARATION.margin
    ),
    st.sampled_from([0.5, 1.0, 2.0]),
    st.sampled_from([0.5, 1.0, 4.0]),
)


def planned(start: Array, velocity: Array, target: Array, limits: FormationChangeConfig) -> Blend | None:
    straight = Blend.within(start, velocity, target, limits.speed_max, limits.acceleration_max)
    return straight if is_free(straight, SEPARATION) else around(straight, limits, SEPARATION)


def check(way: Blend, velocity: Array, limits: FormationChangeConfig) -> None:
    """By a thousand points, and by their differences."""
    if way.duration == 0.0:
        np.testing.assert_array_equal(way.start, way.target)
        return
    times = np.linspace(0.0, way.duration, 1001)
    path = way.at(times)
    first, second = pairs(len(path))
    apart = np.linalg.norm(path[second] - path[first], axis=2).min(axis=1)
    assert (apart >= SEPARATION.needed(way.start, way.target) - 1e-9).all()
    np.testing.assert_array_equal(path[:, 0], way.start)
    np.testing.assert_allclose(path[:, -1], way.target, atol=1e-12)
    np.testing.assert_array_equal(path[0], 0.0)
    np.testing.assert_allclose(way.velocity_at(np.array([0.0]))[:, 0], velocity, atol=1e-9)
    np.testing.assert_array_equal(way.velocity_at(np.array([way.duration]))[:, 0], np.zeros_like(velocity))
    rates = np.diff(path, axis=1) / times[1]
    fastest = max(limits.speed_max, float(np.linalg.norm(velocity, axis=1).max()))
    assert np.linalg.norm(rates, axis=2).max() <= 1.005 * fastest
    assert np.linalg.norm(np.diff(rates, axis=1), axis=2).max() / times[1] <= 1.01 * limits.acceleration_max


@given(two_formations, limits)
def test_from_rest(both: tuple[Array, Array], limits: FormationChangeConfig) -> None:
    start, target = both
    way = planned(start, np.zeros_like(start), target, limits)
    assume(way is not None)
    assert way is not None
    check(way, np.zeros_like(start), limits)
    heights, ends = way.at(np.linspace(0.0, way.duration, 101))[:, :, 2], np.stack([start, target])[:, :, 2]
    assert (heights >= ends.min(axis=0)[:, None] - 1e-12).all()


@given(two_formations, limits, st.floats(0.05, 0.95), st.permutations(range(1, 8)))
def test_on_the_way(
    both: tuple[Array, Array], limits: FormationChangeConfig, share: float, order: list[int]
) -> None:
    """Sent back to other places before they have arrived; no way is found if they are about to meet."""
    start, target = both
    before = planned(start, np.zeros_like(start), target, limits)
    assume(before is not None)
    assert before is not None
    if before.duration == 0.0:
        return
    elapsed = share * before.duration
    places, velocity = before.at(np.array([elapsed]))[:, 0], before.velocity_at(np.array([elapsed]))[:, 0]
    back = start[[0, *(number for number in order if number < len(start))]]
    way = planned(places, velocity, back, limits)
    if way is not None:
        check(way, velocity, limits)
