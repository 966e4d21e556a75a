"""Recorded poses as a path with fewer samples and less noise."""

import numpy as np

from relform_core.arrays import Array

_POINTS = 41
"""Number of points, between the poses too, over which a sample is the mean."""


def smoothed(poses: Array, period: float) -> Array:
    """The path as samples at a period, each the mean of the poses up to half a period before and after it.

    The first and the last sample are the first and the last pose.

    Args:
        poses: time [s], x, y, z [m] and yaw [rad], shape (pose, 5); times increase.
        period: between samples [s], made a little shorter so that the last sample is at the end.
    Returns:
        time from 0 on [s], x, y, z [m] and continuous yaw [deg], shape (sample, 5).
    """
    times = poses[:, 0] - poses[0, 0]
    values = np.column_stack([poses[:, 1:4], np.degrees(np.unwrap(poses[:, 4]))])
    instants = np.linspace(0.0, times[-1], int(np.ceil(times[-1] / period - 1e-9)) + 1)
    around = np.linspace(-0.5, 0.5, _POINTS) * instants[1]
    inner = instants[1:-1, None] + around
    means = [np.interp(inner, times, column).mean(axis=1) for column in values.T]
    places = np.vstack([values[:1], np.stack(means, axis=1), values[-1:]])
    return np.column_stack([instants, places])
