"""Shapes of formations, by hand."""

import math

import numpy as np
import pytest

from relform_core import shapes
from relform_core.formations_config import FormationConfig
from relform_core.load import load_scenario_text
from relform_core.yaml_files import to_text
from support.scenarios import paper_scenario

HALF = math.sqrt(0.5)


def test_line() -> None:
    np.testing.assert_allclose(
        shapes.line(4, 1.5), [[0, 0, 0], [0, -1.5, 0], [0, 1.5, 0], [0, -3, 0]], atol=1e-12
    )


def test_column() -> None:
    np.testing.assert_allclose(shapes.column(3, 0.8), [[0, 0, 0], [-0.8, 0, 0], [-1.6, 0, 0]], atol=1e-12)


def test_v_with_arms_at_right_angles() -> None:
    expected = [[0, 0, 0], [-HALF, -HALF, 0], [-HALF, HALF, 0], [-2 * HALF, -2 * HALF, 0]]
    np.testing.assert_allclose(shapes.v(4, 1.0, math.pi / 2), expected, atol=1e-12)


def test_circle_of_four_is_a_square() -> None:
    expected = [[0, 0, 0], [-1.2 * HALF, -1.2 * HALF, 0], [-2.4 * HALF, 0, 0], [-1.2 * HALF, 1.2 * HALF, 0]]
    np.testing.assert_allclose(shapes.circle(4, 1.2), expected, atol=1e-12)


def test_grid_with_a_row_that_is_not_full() -> None:
    """Three columns; the leader is in the middle of the first row, the last two are centred."""
    expected = [[0, 0, 0], [0, -2, 0], [0, 2, 0], [-2, -1, 0], [-2, 1, 0]]
    np.testing.assert_allclose(shapes.grid(5, 2.0), expected, atol=1e-12)
    np.testing.assert_allclose(shapes.grid(3, 2.0, columns=1), shapes.column(3, 2.0), atol=1e-12)


def test_sphere_has_all_vehicles_at_one_radius_and_the_leader_in_front() -> None:
    places = shapes.sphere(9, 1.1)
    # The centre is where all distances are equal: 2 c (p_k - p_0) = |p_k|^2, as p_0 is zero.
    centre, *_ = np.linalg.lstsq(2.0 * places[1:], (places[1:] ** 2).sum(axis=1), rcond=None)
    radii = np.linalg.norm(places - centre, axis=1)
    np.testing.assert_allclose(radii, radii[0], rtol=1e-9)
    assert places[1:, 0].max() < 0.0


def test_slope_lowers_what_is_behind() -> None:
    sloped = shapes.sloped(np.array([[-2.0, 0.7, 0.0], [0.0, -1.0, 0.0]]), math.radians(30.0))
    np.testing.assert_allclose(sloped, [[-math.sqrt(3.0), 0.7, -1.0], [0.0, -1.0, 0.0]], atol=1e-12)


def formation(written: str, n_followers: int) -> FormationConfig:
    changes = [f"team.followers={n_followers}", f"formations_m={{initial: {written}, wide: {written}}}"]
    return paper_scenario(*changes).config.formations["initial"]


def test_a_shape_in_a_file_is_replaced_by_places() -> None:
    places = formation("{kind: v, spacing_m: 1.0, opening_deg: 120, slope_deg: 30}", 2)
    assert places == {"follower_1": (-0.433, -0.866, -0.25), "follower_2": (-0.433, 0.866, -0.25)}


def test_the_arms_of_a_v_are_at_right_angles_unless_the_file_says_otherwise() -> None:
    places = formation("{kind: v, spacing_m: 1.0}", 2)
    assert places == {"follower_1": (-0.7071, -0.7071, 0.0), "follower_2": (-0.7071, 0.7071, 0.0)}


@pytest.mark.parametrize("kind", ["line", "column", "v", "circle", "grid", "sphere"])
def test_the_effective_configuration_lists_places_and_names(kind: str) -> None:
    """A recording is independent of how a later version generates a shape."""
    written = f"{{kind: {kind}, spacing_m: 1.0}}"
    loaded = paper_scenario("team.followers=6", f"formations_m={{initial: {written}, wide: {written}}}")
    assert loaded.written["team"]["followers"][-1] == "follower_6"
    assert loaded.written["formations_m"]["wide"]["follower_6"] == list(
        loaded.config.formations["wide"]["follower_6"]
    )
    again = load_scenario_text(to_text({**loaded.written, "seed": 0}), "effective")
    assert again.config == loaded.config
    assert again.fingerprint == loaded.fingerprint
