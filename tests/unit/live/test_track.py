"""Where something was between its recent poses."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from relform_analysis.flight.tracking_errors import yaw_of
from relform_core.rotation import quaternion_from_yaw
from relform_live.scene.track import SAMPLES_MAX, Pose, Track, turned


def pose(stamp_ns: int, x: float, yaw: float = 0.3) -> Pose:
    return Pose(stamp_ns, np.array([x, -1.0, 2.0]), quaternion_from_yaw(yaw))


def track_of(*poses: Pose) -> Track:
    track = Track()
    for each in poses:
        track.add(each)
    return track


def test_between_two_poses_is_the_share_of_the_way() -> None:
    track = track_of(pose(100, 1.0, yaw=0.2), pose(200, 3.0, yaw=0.6))
    found = track.at(125)
    assert found.p_NB_N == pytest.approx([1.5, -1.0, 2.0])
    assert yaw_of(found.q_NB) == pytest.approx(0.3, abs=1e-3)


def test_turns_the_shorter_way_round() -> None:
    track = track_of(
        Pose(0, np.zeros(3), quaternion_from_yaw(3.0)), Pose(10, np.zeros(3), -quaternion_from_yaw(3.2))
    )
    assert yaw_of(track.at(5).q_NB) == pytest.approx(3.1, abs=1e-3)


def test_ends_are_the_first_and_the_last_pose() -> None:
    track = track_of(pose(100, 1.0), pose(200, 3.0))
    assert [track.at(stamp).p_NB_N[0] for stamp in (0, 100, 200, 900)] == [1.0, 1.0, 3.0, 3.0]


def test_an_earlier_pose_begins_another_flight() -> None:
    track = track_of(pose(100, 1.0), pose(200, 3.0), pose(50, 7.0))
    assert track.at(150).p_NB_N[0] == 7.0


def test_a_repeated_pose_changes_nothing() -> None:
    track = track_of(pose(100, 1.0), pose(200, 3.0), pose(200, 9.0))
    assert track.newest.p_NB_N[0] == 3.0


def test_keeps_a_bounded_number() -> None:
    track = track_of(*(pose(stamp, float(stamp)) for stamp in range(10 * SAMPLES_MAX)))
    kept = track.between(-1, 10 * SAMPLES_MAX)
    assert [each.stamp_ns for each in kept] == list(range(9 * SAMPLES_MAX, 10 * SAMPLES_MAX))


@given(st.floats(-3.1, 3.1), st.floats(-3.0, 3.0))
def test_turned_is_the_rotation_about_z(yaw: float, x: float) -> None:
    p = np.array([[x, 0.7, -1.2], [0.1, x, 2.0]])
    assert turned(yaw, p) == pytest.approx(Rotation.from_euler("z", yaw).apply(p), abs=1e-12)


@given(st.floats(-3.1, 3.1), st.floats(-1.4, 1.4), st.floats(-1.4, 1.4))
def test_yaw_is_that_of_the_euler_angles(yaw: float, pitch: float, roll: float) -> None:
    q = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_quat()
    assert yaw_of(q) == pytest.approx(yaw, abs=1e-9)
