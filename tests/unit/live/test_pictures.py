"""Meshes, colours and plots of the view."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from relform_live.scene.colours import UNSEEN, css, linear, of_errors, of_vehicles
from relform_live.scene.history import LENGTH_S, POINTS, History
from relform_live.scene.quadrotor_mesh import Mesh, box, disc, frame, rotors
from support.live_flights import nanoseconds


def volume(mesh: Mesh) -> float:
    """By the divergence theorem: right only if the mesh is closed and all its faces look outwards."""
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return float(np.einsum("fi,fi->f", a, np.cross(b, c)).sum() / 6.0)


def test_parts_are_closed_and_face_outwards() -> None:
    assert volume(box((0.4, -0.2, 0.1), (0.3, 0.5, 0.7))) == pytest.approx(0.105)
    rotor = disc((0.4, -0.2, 0.1), 0.5, 0.2)
    assert volume(rotor) == pytest.approx(ConvexHull(rotor.vertices).volume)


def test_the_nose_is_in_front_and_rotors_are_above_the_motors() -> None:
    body = frame()
    assert body.vertices[:, 0].max() == pytest.approx(1.1)  # the front motor
    low = body.vertices[np.abs(body.vertices[:, 1]) < 0.09]
    assert len(low[low[:, 0] > 0.4]) > len(low[low[:, 0] < -0.4])
    assert rotors().vertices[:, 2].min() > body.vertices[:, 2].max()
    assert rotors().faces.max() == len(rotors().vertices) - 1


def test_colours_of_errors() -> None:
    good, between, bad, unknown = of_errors(np.array([0.0, 0.1, 3.0, np.nan])).tolist()
    assert css(good) == "#26a69a"
    assert between == [205, 191, 50]
    assert css(bad) == "#e53935"
    assert tuple(unknown) == UNSEEN


def test_linear_colours() -> None:
    assert linear(np.array([[0, 188, 255]], dtype=np.uint8)).tolist() == [[0, 128, 255]]


def test_vehicles_have_colours_for_any_team() -> None:
    assert of_vehicles(16).shape == (16, 3)
    assert len(np.unique(of_vehicles(7), axis=0)) == 7


def test_history_is_bounded_and_ends_now() -> None:
    history = History(2)
    for step in range(20 * 60):
        history.add(nanoseconds(step / 20.0), step / 20.0, -step)
    ago, up, down = history.columns
    assert (ago[0], ago[-1], len(ago)) == (pytest.approx(-LENGTH_S, abs=0.11), 0.0, POINTS)
    assert np.diff(ago)[1:] == pytest.approx(LENGTH_S / (POINTS - 1))
    assert up == pytest.approx(59.9 + ago)
    assert down[-1] == -1198


def test_history_begins_again_after_a_jump_back() -> None:
    history = History(1)
    history.add(nanoseconds(50.0), 1.0)
    history.add(nanoseconds(5.0), 2.0)
    history.add(nanoseconds(6.0), 3.0)
    ago, values = history.columns
    assert (ago[0], values[0]) == (-1.0, 2.0)  # several times
    assert values == pytest.approx(3.0 + ago)


def test_history_without_values_can_be_drawn() -> None:
    assert np.isfinite(History(2).columns).all()
