"""What crosses the wire from the vehicles, holding exactly what the messages hold.

Times are integer nanoseconds of simulation time, quaternions are (x, y, z, w), everything else is SI and
radians. {n} is the ENU world, {b} the FLU body; a follower's q_NB has a meaningless yaw (see ``Imu``).
"""

from collections.abc import Mapping
from dataclasses import dataclass

from relform_core.arrays import Array


@dataclass(frozen=True, eq=False)
class Imu:
    """sensor_msgs/Imu (REP-145). Roll and pitch of ``q_NB`` are absolute.

    The leader's yaw is as good as its localization; a follower has no magnetometer: its yaw is off by an
    unknown constant and drifts.
    """

    stamp_ns: int
    q_NB: Array
    """Attitude, shape (4,)."""
    attitude_covariance: Array
    """About body x, y, z [rad^2], shape (3, 3)."""
    w_NB_B: Array
    """Angular velocity [rad/s], shape (3,)."""
    gyro_covariance: Array
    """[(rad/s)^2], shape (3, 3)."""
    f_NB_B: Array
    """Specific force, +g on the z axis at rest [m/s^2], shape (3,)."""
    accelerometer_covariance: Array
    """[(m/s^2)^2], shape (3, 3)."""


@dataclass(frozen=True, eq=False)
class OpticFlow:
    """geometry_msgs/TwistWithCovarianceStamped: velocity in the body frame."""

    stamp_ns: int
    v_NB_B: Array
    """[m/s], shape (3,)."""
    covariance: Array
    """[(m/s)^2], shape (3, 3)."""


@dataclass(frozen=True)
class Sonar:
    """sensor_msgs/Range (REP-117: +inf beyond range_max, -inf below range_min), in float32 precision."""

    stamp_ns: int
    range: float
    """Height above ground [m]."""
    range_min: float
    range_max: float
    field_of_view: float
    """[rad]."""


@dataclass(frozen=True, eq=False)
class RangeBearing:
    """relform_msgs/RangeBearing: one target in the observer's body frame (eqs. CameraRange1, 2)."""

    target: str
    range: float
    azimuth: float
    elevation: float
    covariance: Array
    """Of range, azimuth, elevation, shape (3, 3)."""


@dataclass(frozen=True, eq=False)
class RangeBearings:
    """relform_msgs/RangeBearingArray: all targets that one vehicle sees at one instant."""

    stamp_ns: int
    by_target: Mapping[str, RangeBearing]


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
    """Everything that one vehicle measured at one instant; what was lost is None."""

    imu: Imu | None
    optic_flow: OpticFlow | None
    sonar: Sonar | None
    range_bearing: RangeBearings | None
    localization: Odometry | None
    """Only the leader has it."""


@dataclass(frozen=True)
class TeamMeasurements:
    """The consistent set of measurements of one control step, by vehicle name in team order."""

    step: int
    stamp_ns: int
    by_vehicle: Mapping[str, VehicleMeasurements]


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
