"""What crosses the wire between the vehicles and the controller, holding exactly what the messages hold.

Times are integer nanoseconds of simulation time, quaternions are (x, y, z, w), everything else is SI and
radians. {n} is the ENU world, {b} the FLU body. What each sensor measures is in ``relform_core.sensors``.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Self

from relform_core.arrays import Array
from relform_core.flight_modes import Request
from relform_core.sensors.sensor import M, Measurement, Source

UNMEASURED_VARIANCE = 1e9
"""Variance that says: this component of a standard message is not measured."""


@dataclass(frozen=True, eq=False)
class Odometry:
    """nav_msgs/Odometry: pose in {n}, velocities in {b}. Ground truth, or the leader's localization."""

    stamp_ns: int
    p_NB_N: Array
    """[m], shape (3,)."""
    q_NB: Array
    """Shape (4,)."""
    v_NB_B: Array
    """[m/s], shape (3,)."""
    w_NB_B: Array
    """[rad/s], shape (3,)."""
    pose_covariance: Array
    """Position [m^2], then rotation about x, y, z [rad^2], shape (6, 6); all zero: exact."""
    twist_covariance: Array
    """Shape (6, 6); all zero: exact."""


@dataclass(frozen=True)
class VehicleMeasurements:
    """The measurements of one vehicle that arrived in one control step.

    Each has the stamp of its own instant, which may lie before the step. A sensor may have several, or none:
    nothing was measured, or it was lost or is still on its way.
    """

    by_sensor: Mapping[str, tuple[Measurement, ...]]
    """By name of the sensor, from the oldest to the newest stamp; a sensor without measurements is absent."""

    @classmethod
    def collect(cls, arrived: Iterable[tuple[Source[Any], Measurement]]) -> Self:
        """Sort what arrived, in any order, by sensor and stamp."""
        by_sensor: dict[str, list[Measurement]] = {}
        for source, measurement in arrived:
            by_sensor.setdefault(source.name, []).append(measurement)
        return cls({name: tuple(sorted(each, key=_stamp_ns)) for name, each in by_sensor.items()})

    def newest(self, source: Source[M]) -> M | None:
        """The measurement of a sensor with the newest stamp; None: none arrived."""
        arrived = self.arrived(source)
        return arrived[-1] if arrived else None

    def arrived(self, source: Source[M]) -> tuple[M, ...]:
        """All measurements of a sensor, from the oldest to the newest stamp."""
        return self.by_sensor.get(source.name, ())  # type: ignore[return-value]  # ``collect`` keeps the types


@dataclass(frozen=True)
class TeamMeasurements:
    """All measurements that arrived in one control step."""

    step: int
    arrival_ns: int
    """Instant of the step. The measurements have stamps of their own, this one or earlier."""
    by_vehicle: Mapping[str, VehicleMeasurements]
    """By vehicle name, in team order."""


@dataclass(frozen=True, eq=False)
class RotorCommand:
    """relform_msgs/RotorSpeeds: a command and the plan to fall back on; rotors front, left, back, right."""

    stamp_ns: int
    """Start of the interval in which ``speeds`` apply."""
    period_ns: int
    speeds: Array
    """[rad/s], shape (4,)."""
    predicted_speeds: Array
    """The intervals that follow [rad/s], shape (intervals, 4)."""
    request: Request = Request.FLY


def _stamp_ns(measurement: Measurement) -> int:
    return measurement.stamp_ns
