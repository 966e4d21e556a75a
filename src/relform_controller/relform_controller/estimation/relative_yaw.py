"""Relative yaw of two vehicles from their mutual ranges and bearings (eqs. YawEst1 to YawEst5).

Vehicle 1 sees vehicle 2 and is seen by it. Levelled with roll and pitch, the two displacements are opposite
up to the difference of the yaws. The paper solves for psi_1 - psi_2; the rotation of eq. RelPos1 needs its
negative. Every function here returns that: ``yaw_I1I2 = psi_2 - psi_1``, so ``R_I1I2 = R_z(yaw_I1I2)``.
"""

import math
from dataclasses import dataclass

import numpy as np

from relform_controller.ocp.frames import wrap_angle
from relform_core.arrays import Array
from relform_core.sensors.range_bearing import RangeBearing


@dataclass(frozen=True)
class YawEstimate:
    """A relative yaw and how well it is known."""

    yaw: float
    """[rad], in (-pi, pi]."""
    variance: float
    """[rad^2]; infinite where the yaw cannot be observed."""


def relative_position_B(seen: RangeBearing) -> Array:
    """p_B1B2_B1 of the vehicle that is seen [m], shape (3,) (eqs. CameraRange1 and CameraRange2)."""
    horizontal = seen.range * math.cos(seen.elevation)
    return np.array(
        [
            horizontal * math.cos(seen.azimuth),
            horizontal * math.sin(seen.azimuth),
            seen.range * math.sin(seen.elevation),
        ]
    )


def relative_position_covariance_B(seen: RangeBearing) -> Array:
    """Covariance of `relative_position_B` to first order [m^2], shape (3, 3)."""
    r = seen.range
    cos_az, sin_az = math.cos(seen.azimuth), math.sin(seen.azimuth)
    cos_el, sin_el = math.cos(seen.elevation), math.sin(seen.elevation)
    by_range = [cos_el * cos_az, cos_el * sin_az, sin_el]
    by_azimuth = [-r * cos_el * sin_az, r * cos_el * cos_az, 0.0]
    by_elevation = [-r * sin_el * cos_az, -r * sin_el * sin_az, r * cos_el]
    jacobian = np.array([by_range, by_azimuth, by_elevation]).T
    covariance: Array = jacobian @ seen.covariance @ jacobian.T
    return covariance


def yaw_from_mutual_sight(
    seen_by_1: RangeBearing, R_C1B1: Array, seen_by_2: RangeBearing, R_C2B2: Array
) -> YawEstimate:
    """yaw_I1I2 from what two vehicles see of each other.

    Args:
        seen_by_1: vehicle 2 in the body frame of vehicle 1.
        R_C1B1: R_y(pitch) R_x(roll) of vehicle 1, shape (3, 3).
        seen_by_2: vehicle 1 in the body frame of vehicle 2.
        R_C2B2: R_y(pitch) R_x(roll) of vehicle 2, shape (3, 3).
    """
    b = R_C1B1 @ relative_position_B(seen_by_1)
    a = -R_C2B2 @ relative_position_B(seen_by_2)
    psi_1_minus_psi_2 = math.atan2(a[1] * b[0] - a[0] * b[1], a[0] * b[0] + a[1] * b[1])  # eq. YawEst5
    variance = _heading_variance(b, R_C1B1, seen_by_1) + _heading_variance(a, R_C2B2, seen_by_2)
    return YawEstimate(wrap_angle(-psi_1_minus_psi_2), variance)


def _heading_variance(p_C: Array, R_CB: Array, seen: RangeBearing) -> float:
    """Variance of the horizontal direction of ``p_C`` [rad^2]; infinite where p_C is vertical."""
    baseline2 = float(p_C[0] ** 2 + p_C[1] ** 2)
    if baseline2 < 1e-12:
        return math.inf
    heading_by_position = R_CB.T @ np.array([-p_C[1], p_C[0], 0.0]) / baseline2
    return float(heading_by_position @ relative_position_covariance_B(seen) @ heading_by_position)


def propagate(
    estimate: YawEstimate, rate_1: float, rate_2: float, rate_variance: float, period: float
) -> YawEstimate:
    """Hold a relative yaw over one period with the yaw rates of both vehicles.

    Args:
        estimate: one period ago.
        rate_1: yaw rate of vehicle 1 [rad/s].
        rate_2: yaw rate of vehicle 2 [rad/s].
        rate_variance: of the difference of the rates [(rad/s)^2].
        period: [s].
    """
    yaw = wrap_angle(estimate.yaw + (rate_2 - rate_1) * period)
    return YawEstimate(yaw, estimate.variance + rate_variance * period**2)
