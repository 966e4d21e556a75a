"""Margins of the vehicles in each other's field of view."""

import numpy as np

from relform_analysis.flight.log import FlightLog
from relform_core.arrays import Array
from relform_core.sensors.range_bearing import RANGE_BEARING


def view_margins(log: FlightLog) -> Array:
    """Angle by which each vehicle is inside the field of view of each other one.

    From the truth, at every instant. It is the angle of the bearing to the nearest limit of the sector in
    which it lies deepest, along azimuth or elevation; negative: in no sector.

    Returns:
        Margins [rad], shape (T, n, n), axes observer i, target j; NaN for vehicles that the observer does not
        see, itself included.
    """
    p_BB_N = log.p_NB_N[:, None, :, :] - log.p_NB_N[:, :, None, :]
    p_BB_B = into_body(p_BB_N, log.q_NB[:, :, None, :])
    x, y, z = np.moveaxis(p_BB_B, -1, 0)
    azimuth, elevation = np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))
    sectors = log.scenario.config.sensors.of(RANGE_BEARING).sectors
    margins: Array = np.max([sector.margins(azimuth, elevation) for sector in sectors], axis=0)
    targets_of = log.scenario.config.targets_of
    for i, observer in enumerate(log.vehicles):
        margins[:, i, [target not in targets_of[observer] for target in log.vehicles]] = np.nan
    return margins


def into_body(p_N: Array, q_NB: Array) -> Array:
    """R_NB^T p_N, shape (..., 3); ``q_NB`` is a unit quaternion (x, y, z, w), shape (..., 4).

    SciPy's Rotation would take longer to import than a flight takes to score.
    """
    axis, w = -q_NB[..., :3], q_NB[..., 3:]
    twice = 2.0 * np.cross(axis, p_N)
    p_B: Array = p_N + w * twice + np.cross(axis, twice)
    return p_B
