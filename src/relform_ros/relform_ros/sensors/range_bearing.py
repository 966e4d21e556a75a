"""relform_msgs/RangeBearingArray: range and bearing to the other vehicles."""

import math
from collections.abc import Collection

import numpy as np

from relform_core.arrays import Array
from relform_core.sensors.range_bearing import RangeBearing, RangeBearings
from relform_msgs.msg import RangeBearing as RangeBearingMsg
from relform_msgs.msg import RangeBearingArray as RangeBearingArrayMsg
from relform_ros.fields import (
    MAGNITUDE_MAX,
    body_frame,
    covariance_from_msg,
    flat,
    header_from_msg,
    header_to_msg,
)
from relform_ros.rejection import Reason, RejectionError

MESSAGE = RangeBearingArrayMsg
CORRELATION_TOLERANCE = 1e-9
"""How far below zero rounding may bring an eigenvalue of correlations."""


def to_msg(bearings: RangeBearings, vehicle: str) -> RangeBearingArrayMsg:
    """All that a vehicle sees."""
    return RangeBearingArrayMsg(
        header=header_to_msg(bearings.stamp_ns, body_frame(vehicle)),
        observations=[
            RangeBearingMsg(
                target_id=bearing.target,
                range=bearing.range,
                azimuth=bearing.azimuth,
                elevation=bearing.elevation,
                covariance=flat(bearing.covariance),
            )
            for bearing in bearings.by_target.values()
        ],
    )


def from_msg(msg: RangeBearingArrayMsg, vehicle: str, team: Collection[str]) -> RangeBearings:
    """All that a vehicle sees.

    Args:
        team: names of all vehicles.
    Raises:
        RejectionError: the message cannot be used, see ``fields``; also an unknown or repeated target.
    """
    stamp_ns = header_from_msg(msg.header, body_frame(vehicle))
    by_target: dict[str, RangeBearing] = {}
    for observation in msg.observations:
        target = observation.target_id
        if target not in team or target == vehicle:
            raise RejectionError(Reason.FOREIGN, f"target '{target}' is none of the others in the team")
        if target in by_target:
            raise RejectionError(Reason.INVALID, f"target '{target}' is named twice")
        by_target[target] = _range_bearing_from_msg(observation)
    return RangeBearings(stamp_ns=stamp_ns, by_target=by_target)


def _range_bearing_from_msg(msg: RangeBearingMsg) -> RangeBearing:
    for what, usable, bounds in (
        ("range", 0.0 < msg.range <= MAGNITUDE_MAX, f"positive and at most {MAGNITUDE_MAX:g} m"),
        ("azimuth", abs(msg.azimuth) <= math.pi, "in [-pi, pi]"),
        ("elevation", abs(msg.elevation) <= math.pi / 2, "in [-pi/2, pi/2]"),
    ):
        if not usable:
            value = getattr(msg, what)
            raise RejectionError(
                Reason.INVALID, f"{what} to '{msg.target_id}' must be {bounds} (got {value})"
            )
    return RangeBearing(
        target=msg.target_id,
        range=msg.range,
        azimuth=msg.azimuth,
        elevation=msg.elevation,
        covariance=_definite(covariance_from_msg(msg.covariance, 3, "covariance")),
    )


def _definite(covariance: Array) -> Array:
    """The covariance itself: unlike those of other sensors, it is used with its correlations.

    Raises:
        RejectionError: it is not symmetric, or not positive semidefinite.
    """
    diagonal = covariance.diagonal()
    if np.count_nonzero(covariance) > np.count_nonzero(diagonal):
        scale = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
        correlations = covariance / scale / scale[:, None]
        is_symmetric = np.array_equal(covariance, covariance.T)
        if not is_symmetric or np.linalg.eigvalsh(correlations)[0] < -CORRELATION_TOLERANCE:
            raise RejectionError(Reason.INVALID, "covariance must be symmetric and positive semidefinite")
    return covariance
