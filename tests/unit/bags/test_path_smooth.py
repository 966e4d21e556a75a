"""Recorded poses become a path with fewer samples."""

import numpy as np

from relform_bags.path_export.smooth import smoothed


def test_straight_way_at_irregular_times() -> None:
    times = np.array([3.0, 3.1, 3.5, 3.6, 4.2, 4.4])
    elapsed = times - 3.0
    poses = np.column_stack([times, 2.0 * elapsed, 1.0 - elapsed, 0.5 + 0.0 * times, 3.0 + elapsed])
    poses[:, 4] = np.arctan2(np.sin(poses[:, 4]), np.cos(poses[:, 4]))  # it passes 180 degrees
    samples = smoothed(poses, 0.5)
    np.testing.assert_allclose(samples[:, 0], [0.0, 1.4 / 3.0, 2.8 / 3.0, 1.4])
    t = samples[:, 0]
    np.testing.assert_allclose(
        samples[:, 1:4], np.column_stack([2.0 * t, 1.0 - t, 0.5 + 0.0 * t]), atol=1e-12
    )
    np.testing.assert_allclose(samples[:, 4], np.degrees(3.0 + t), atol=1e-9)


def test_noise_is_averaged_within_half_a_period() -> None:
    """From 0.75 to 1.25 s the pose is 1 m off for 0.25 s, with flanks of 0.05 s, which is 0.6 of a period."""
    times = np.array([0.0, 0.80, 0.85, 1.10, 1.15, 2.0])
    poses = np.zeros((6, 5))
    poses[:, 0], poses[2:4, 2] = times, 1.0
    samples = smoothed(poses, 0.5)
    np.testing.assert_allclose(samples[:, 0], [0.0, 0.5, 1.0, 1.5, 2.0])
    np.testing.assert_allclose(samples[:, 2], [0.0, 0.0, 0.6, 0.0, 0.0], atol=0.02)
