"""Measurements and commands arrive bit for bit; messages that cannot be used are rejected with the reason."""

import contextlib
import inspect
import math
import re
import struct
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from rclpy.serialization import serialize_message

from relform_core.flight_modes import Request, VehicleMode
from relform_core.measurements import Odometry, RotorCommand
from relform_core.sensors.applied_rotor_speeds import APPLIED_ROTOR_SPEEDS, AppliedRotorSpeeds
from relform_core.sensors.barometer import AirPressure
from relform_core.sensors.flight_status import FLIGHT_STATUS, FlightStatus
from relform_core.sensors.imu import Imu
from relform_core.sensors.optic_flow import OpticFlow
from relform_core.sensors.range_bearing import RangeBearing, RangeBearings
from relform_core.sensors.registry import SENSORS
from relform_core.sensors.sensor import Source
from relform_core.sensors.sonar import Sonar
from relform_ros import commands
from relform_ros import odometry as odometry_wire
from relform_ros.fields import MAGNITUDE_MAX
from relform_ros.raw import raw_stamp_ns
from relform_ros.rejection import EXPLANATION_MAX, Reason, RejectionError
from relform_ros.sensors import applied_rotor_speeds as applied_wire
from relform_ros.sensors import barometer as barometer_wire
from relform_ros.sensors import flight_status as status_wire
from relform_ros.sensors import imu as imu_wire
from relform_ros.sensors import optic_flow as flow_wire
from relform_ros.sensors import range_bearing as bearings_wire
from relform_ros.sensors import sonar as sonar_wire
from relform_ros.sensors.wire import wire
from support.wire import bits, over_the_wire

TEAM = ("leader", "follower_1", "follower_2")
NAME = "follower_1"
FINITE = st.floats(allow_nan=False, allow_infinity=False)
STAMPS = st.integers(0, (2**31 - 1) * 10**9 + 999_999_999)


def array(*shape: int, elements: st.SearchStrategy[float] = FINITE) -> st.SearchStrategy[Any]:
    return arrays(np.float64, shape, elements=elements)


NUMBERS = st.floats(-MAGNITUDE_MAX, MAGNITUDE_MAX)


def unit(parts: Any) -> Any:
    norm = np.linalg.norm(parts)
    return parts / norm if norm > 1e-3 else np.array([0.0, 0.0, -0.0, 1.0])


@st.composite
def covariance(draw: st.DrawFn, size: int) -> Any:
    matrix = draw(array(size, size))
    np.fill_diagonal(matrix, np.abs(matrix.diagonal()))
    return matrix


@st.composite
def correlated(draw: st.DrawFn) -> Any:
    """A covariance of full or lower rank, or a diagonal one."""
    root = draw(array(3, 3, elements=st.floats(-10.0, 10.0)))
    full = root @ root.T
    return full if draw(st.booleans()) else np.diag(full.diagonal())


UNIT = array(4, elements=st.floats(-1.0, 1.0)).map(unit)
IMU = st.builds(
    Imu,
    stamp_ns=STAMPS,
    q_NB=UNIT,
    attitude_covariance=covariance(3),
    w_NB_B=array(3, elements=NUMBERS),
    gyro_covariance=covariance(3),
    f_NB_B=array(3, elements=NUMBERS),
    accelerometer_covariance=covariance(3),
)
OPTIC_FLOW = st.builds(
    OpticFlow, stamp_ns=STAMPS, v_NB_B=array(3, elements=NUMBERS), covariance=covariance(3)
)
METRES = st.floats(0.0, MAGNITUDE_MAX, width=32)
SONAR = st.builds(
    Sonar,
    stamp_ns=STAMPS,
    range=METRES | st.sampled_from([math.inf, -math.inf]),
    range_min=METRES,
    range_max=METRES,
    field_of_view=METRES,
)
RANGE_BEARING = st.builds(
    RangeBearing,
    target=st.just(""),
    range=st.floats(0.0, MAGNITUDE_MAX, exclude_min=True),
    azimuth=st.floats(-math.pi, math.pi),
    elevation=st.floats(-math.pi / 2, math.pi / 2),
    covariance=correlated(),
)


@st.composite
def range_bearings(draw: st.DrawFn) -> RangeBearings:
    targets = draw(st.lists(st.sampled_from(["leader", "follower_2"]), unique=True))
    seen = [RangeBearing(**{**vars(draw(RANGE_BEARING)), "target": target}) for target in targets]
    return RangeBearings(draw(STAMPS), {each.target: each for each in seen})


ODOMETRY = st.builds(
    Odometry,
    stamp_ns=STAMPS,
    p_NB_N=array(3, elements=NUMBERS),
    q_NB=UNIT,
    v_NB_B=array(3, elements=NUMBERS),
    w_NB_B=array(3, elements=NUMBERS),
    pose_covariance=covariance(6),
    twist_covariance=covariance(6),
)
AIR_PRESSURE = st.builds(
    AirPressure,
    stamp_ns=STAMPS,
    pressure=st.floats(0.0, 1e300, exclude_min=True),
    variance=st.floats(0.0, 1e300),
)
SPEED = st.floats(0.0, MAGNITUDE_MAX)
ROTOR_COMMAND = st.builds(
    RotorCommand,
    stamp_ns=STAMPS,
    period_ns=st.integers(1, 10**10),
    speeds=array(4, elements=SPEED),
    predicted_speeds=st.integers(0, 5).flatmap(lambda n: array(n, 4, elements=SPEED)),
    request=st.sampled_from(Request),
)


APPLIED = st.builds(
    AppliedRotorSpeeds,
    stamp_ns=STAMPS,
    period_ns=st.integers(1, 10**10),
    speeds=st.integers(0, 5).flatmap(lambda n: array(n, 4, elements=SPEED)),
    command_stamp_ns=st.none() | STAMPS,
)


@given(IMU)
def test_imu_roundtrip(imu: Imu) -> None:
    message = over_the_wire(imu_wire.to_msg(imu, NAME))
    assert bits(imu_wire.from_msg(message, NAME, TEAM)) == bits(imu)


@given(OPTIC_FLOW)
def test_optic_flow_roundtrip(flow: OpticFlow) -> None:
    message = over_the_wire(flow_wire.to_msg(flow, NAME))
    assert bits(flow_wire.from_msg(message, NAME, TEAM)) == bits(flow)


@given(SONAR)
def test_sonar_roundtrip(sonar: Sonar) -> None:
    message = over_the_wire(sonar_wire.to_msg(sonar, NAME))
    assert bits(sonar_wire.from_msg(message, NAME, TEAM)) == bits(sonar)


@given(range_bearings())
def test_range_bearings_roundtrip(bearings: RangeBearings) -> None:
    message = over_the_wire(bearings_wire.to_msg(bearings, NAME))
    assert bits(bearings_wire.from_msg(message, NAME, TEAM)) == bits(bearings)


@given(ODOMETRY)
def test_odometry_roundtrip(odometry: Odometry) -> None:
    message = over_the_wire(odometry_wire.odometry_to_msg(odometry, NAME))
    assert bits(odometry_wire.odometry_from_msg(message, NAME)) == bits(odometry)


@given(ODOMETRY, st.text("abc_ü1", min_size=1, max_size=9))
def test_serialized_odometry_is_read_like_its_message(odometry: Odometry, vehicle: str) -> None:
    """Names of all lengths, because the numbers behind them are aligned."""
    data = serialize_message(odometry_wire.odometry_to_msg(odometry, vehicle))
    read = odometry_wire.odometry_from_data(data, vehicle)
    assert bits(read) == bits(odometry)
    assert all(value.flags.owndata for value in vars(read).values() if isinstance(value, np.ndarray))


def test_odometry_in_another_byte_order_is_read_too() -> None:
    data = serialize_message(odometry_message())
    text = struct.Struct("<iII4sI21s7x85d")
    fields = text.unpack_from(data, 4)
    other = b"\x00\x00\x00\x00" + struct.Struct(text.format.replace("<", ">")).pack(*fields)
    expected = odometry_wire.odometry_from_data(data, NAME)
    assert bits(odometry_wire.odometry_from_data(other, NAME)) == bits(expected)


@given(ROTOR_COMMAND)
def test_rotor_command_roundtrip(command: RotorCommand) -> None:
    message = over_the_wire(commands.rotor_command_to_msg(command, NAME))
    assert bits(commands.rotor_command_from_msg(message, NAME)) == bits(command)


@given(AIR_PRESSURE)
def test_air_pressure_roundtrip(measurement: AirPressure) -> None:
    message = over_the_wire(barometer_wire.to_msg(measurement, NAME))
    assert bits(barometer_wire.from_msg(message, NAME, TEAM)) == bits(measurement)


EYE3, EYE6 = np.eye(3), np.eye(6)
STAMP_NS = 12_345_678_901
ATTITUDE = np.array([0.1, -0.2, 0.3, math.sqrt(1.0 - 0.14)])
VECTOR = np.array([1.5, -2.5, 3.5])


def imu_message() -> Any:
    return imu_wire.to_msg(Imu(STAMP_NS, ATTITUDE, EYE3, VECTOR, EYE3, VECTOR, EYE3), NAME)


def flow_message() -> Any:
    return flow_wire.to_msg(OpticFlow(STAMP_NS, VECTOR, EYE3), NAME)


def sonar_message() -> Any:
    return sonar_wire.to_msg(Sonar(STAMP_NS, 2.5, 0.25, 10.0, 0.5), NAME)


def bearings_message() -> Any:
    seen = {target: RangeBearing(target, 1.5, -2.5, 0.5, EYE3) for target in ("leader", "follower_2")}
    return bearings_wire.to_msg(RangeBearings(STAMP_NS, seen), NAME)


def odometry_message() -> Any:
    return odometry_wire.odometry_to_msg(
        Odometry(STAMP_NS, VECTOR, ATTITUDE, VECTOR, VECTOR, EYE6, EYE6), NAME
    )


@given(APPLIED)
def test_applied_rotor_speeds_roundtrip(applied: AppliedRotorSpeeds) -> None:
    message = over_the_wire(applied_wire.to_msg(applied, NAME))
    assert bits(applied_wire.from_msg(message, NAME, TEAM)) == bits(applied)


@pytest.mark.parametrize("mode", VehicleMode)
def test_flight_status_roundtrip(mode: VehicleMode) -> None:
    status = FlightStatus(STAMP_NS, mode, f"it is {mode.name}")
    assert status_wire.from_msg(over_the_wire(status_wire.to_msg(status, NAME)), NAME, TEAM) == status


def command_message() -> Any:
    speeds = np.arange(500.0, 504.0)
    return commands.rotor_command_to_msg(
        RotorCommand(STAMP_NS, 50_000_000, speeds, np.tile(speeds, (14, 1)), Request.HOVER), NAME
    )


def pressure_message() -> Any:
    return barometer_wire.to_msg(AirPressure(STAMP_NS, 101_300.5, 36.0), NAME)


def applied_message() -> Any:
    speeds = np.full((20, 4), 501.5)
    return applied_wire.to_msg(AppliedRotorSpeeds(STAMP_NS, 50_000_000, speeds, STAMP_NS), NAME)


def status_message() -> Any:
    return status_wire.to_msg(FlightStatus(STAMP_NS, VehicleMode.LANDING, "asked to"), NAME)


KINDS: dict[str, tuple[Callable[[], Any], Callable[[Any], Any]]] = {
    "imu": (imu_message, lambda message: imu_wire.from_msg(message, NAME, TEAM)),
    "flow": (flow_message, lambda message: flow_wire.from_msg(message, NAME, TEAM)),
    "sonar": (sonar_message, lambda message: sonar_wire.from_msg(message, NAME, TEAM)),
    "bearings": (bearings_message, lambda message: bearings_wire.from_msg(message, NAME, TEAM)),
    "pressure": (pressure_message, lambda message: barometer_wire.from_msg(message, NAME, TEAM)),
    "applied": (applied_message, lambda message: applied_wire.from_msg(message, NAME, TEAM)),
    "status": (status_message, lambda message: status_wire.from_msg(message, NAME, TEAM)),
    "odometry": (odometry_message, lambda message: odometry_wire.odometry_from_msg(message, NAME)),
    "odometry data": (
        odometry_message,
        lambda message: odometry_wire.odometry_from_data(serialize_message(message), NAME),
    ),
    "command": (command_message, lambda message: commands.rotor_command_from_msg(message, NAME)),
}
NAN, INF = math.nan, math.inf


def change(message: Any, path: str, value: Any) -> None:
    """Set a field, by a path such as ``pose.covariance[7]``."""
    *parents, last = re.findall(r"\w+", path)
    for name in parents:
        message = message[int(name)] if name.isdecimal() else getattr(message, name)
    if last.isdecimal():
        message[int(last)] = value
    else:
        setattr(message, last, value)


@pytest.mark.parametrize("kind", KINDS)
def test_the_unchanged_messages_are_accepted(kind: str) -> None:
    make, take = KINDS[kind]
    assert take(over_the_wire(make())).stamp_ns == STAMP_NS


@pytest.mark.parametrize(
    ("kind", "path", "value", "reason", "says"),
    [
        (
            "imu",
            "header.frame_id",
            "leader/base_link",
            Reason.FOREIGN,
            "frame_id must be 'follower_1/base_link'",
        ),
        ("imu", "header.stamp.sec", -1, Reason.INVALID, "no valid stamp"),
        ("imu", "header.stamp.nanosec", 10**9, Reason.INVALID, "no valid stamp"),
        ("imu", "orientation.w", NAN, Reason.INVALID, "orientation must be finite"),
        ("imu", "orientation.w", 0.95, Reason.INVALID, "orientation must be a unit quaternion (got norm 1.0"),
        ("imu", "angular_velocity.y", -INF, Reason.INVALID, "angular_velocity must be finite"),
        ("imu", "angular_velocity.y", -1.1e8, Reason.INVALID, "angular_velocity must be within 1e+08 (got ["),
        ("imu", "linear_acceleration.z", NAN, Reason.INVALID, "linear_acceleration must be finite"),
        (
            "imu",
            "orientation_covariance[4]",
            -1.0,
            Reason.INVALID,
            "orientation_covariance must not have neg",
        ),
        (
            "imu",
            "angular_velocity_covariance[1]",
            NAN,
            Reason.INVALID,
            "angular_velocity_covariance must be fin",
        ),
        ("imu", "linear_acceleration_covariance[8]", INF, Reason.INVALID, "linear_acceleration_covariance"),
        ("flow", "header.frame_id", "", Reason.FOREIGN, "(got '')"),
        ("flow", "twist.twist.linear.x", NAN, Reason.INVALID, "twist.linear must be finite"),
        ("flow", "twist.covariance[7]", -0.5, Reason.INVALID, "negative variances"),
        ("sonar", "header.frame_id", "map", Reason.FOREIGN, "(got 'map')"),
        ("sonar", "range", NAN, Reason.INVALID, "range must be infinite, or 0 to 1e+08 m (got nan)"),
        ("sonar", "range", 2e8, Reason.INVALID, "0 to 1e+08 m"),
        ("sonar", "range", -0.5, Reason.INVALID, "(got -0.5)"),
        ("sonar", "min_range", -0.5, Reason.INVALID, "min_range must be finite and not negative"),
        ("sonar", "max_range", INF, Reason.INVALID, "max_range must be finite"),
        ("sonar", "field_of_view", NAN, Reason.INVALID, "field_of_view must be finite"),
        ("bearings", "header.frame_id", "leader/base_link", Reason.FOREIGN, "frame_id"),
        ("bearings", "observations[1].target_id", "leader", Reason.INVALID, "'leader' is named twice"),
        ("bearings", "observations[0].target_id", NAME, Reason.FOREIGN, "target 'follower_1'"),
        ("bearings", "observations[0].target_id", "ufo", Reason.FOREIGN, "target 'ufo'"),
        ("bearings", "observations[1].range", 0.0, Reason.INVALID, "range to 'follower_2' must be positive"),
        ("bearings", "observations[1].range", INF, Reason.INVALID, "(got inf)"),
        ("bearings", "observations[1].azimuth", 3.15, Reason.INVALID, "azimuth to 'follower_2'"),
        ("bearings", "observations[1].elevation", NAN, Reason.INVALID, "elevation to 'follower_2'"),
        ("bearings", "observations[1].range", 1.1e8, Reason.INVALID, "at most 1e+08 m (got 110000000.0)"),
        ("bearings", "observations[1].covariance[3]", NAN, Reason.INVALID, "covariance must be finite"),
        ("bearings", "observations[1].covariance[3]", 0.5, Reason.INVALID, "must be symmetric and positive"),
        ("pressure", "header.frame_id", "leader/base_link", Reason.FOREIGN, "frame_id"),
        ("pressure", "header.stamp.sec", -1, Reason.INVALID, "no valid stamp"),
        ("pressure", "fluid_pressure", NAN, Reason.INVALID, "fluid_pressure must be positive and finite"),
        ("pressure", "fluid_pressure", INF, Reason.INVALID, "(got inf Pa)"),
        ("pressure", "fluid_pressure", 0.0, Reason.INVALID, "(got 0.0 Pa)"),
        ("pressure", "variance", -1.0, Reason.INVALID, "variance must be finite and not negative"),
        ("pressure", "variance", NAN, Reason.INVALID, "(got nan Pa^2)"),
        ("odometry", "header.frame_id", "odom", Reason.FOREIGN, "frame_id must be 'map' (got 'odom')"),
        ("odometry", "child_frame_id", "leader/base_link", Reason.FOREIGN, "child_frame_id must be"),
        ("odometry", "pose.pose.position.z", NAN, Reason.INVALID, "position must be finite"),
        ("odometry", "pose.pose.orientation.x", 2.0, Reason.INVALID, "unit quaternion"),
        ("odometry", "twist.twist.linear.y", INF, Reason.INVALID, "twist.linear must be finite"),
        ("odometry", "twist.twist.angular.y", NAN, Reason.INVALID, "twist.angular must be finite"),
        ("odometry", "pose.covariance[14]", -1e-9, Reason.INVALID, "pose.covariance must not have negative"),
        ("odometry", "twist.covariance[35]", NAN, Reason.INVALID, "twist.covariance must be finite"),
        ("odometry data", "header.frame_id", "odom", Reason.FOREIGN, "frame_id must be 'map' (got 'odom')"),
        ("odometry data", "child_frame_id", "leader/base_link", Reason.FOREIGN, "child_frame_id must be"),
        ("odometry data", "pose.pose.position.z", NAN, Reason.INVALID, "position must be finite"),
        (
            "odometry data",
            "twist.twist.angular.x",
            -1e300,
            Reason.INVALID,
            "twist.angular must be within 1e+08",
        ),
        ("odometry data", "pose.pose.orientation.x", 2.0, Reason.INVALID, "unit quaternion"),
        ("odometry data", "twist.twist.linear.y", INF, Reason.INVALID, "twist.linear must be finite"),
        ("odometry data", "twist.twist.angular.y", NAN, Reason.INVALID, "twist.angular must be finite"),
        (
            "odometry data",
            "pose.covariance[14]",
            -1e-9,
            Reason.INVALID,
            "pose.covariance must not have negative",
        ),
        ("odometry data", "twist.covariance[35]", NAN, Reason.INVALID, "twist.covariance must be finite"),
        ("command", "header.frame_id", "follower_2/base_link", Reason.FOREIGN, "frame_id"),
        ("command", "speeds[2]", NAN, Reason.INVALID, "speeds must be finite"),
        ("command", "speeds[2]", -1.0, Reason.INVALID, "speeds must not be negative (got -1 rad/s)"),
        ("command", "predicted_speeds[55]", INF, Reason.INVALID, "predicted_speeds must be finite"),
        ("command", "predicted_speeds[0]", -2.0, Reason.INVALID, "predicted_speeds must not be negative"),
        ("command", "period.nanosec", 0, Reason.INVALID, "period must be positive (got 0 ns)"),
        ("command", "period.sec", -1, Reason.INVALID, "period must be positive"),
        ("command", "request", 7, Reason.INVALID, "request must be 0 to 6 (got 7)"),
        ("applied", "header.frame_id", "leader/base_link", Reason.FOREIGN, "frame_id"),
        ("applied", "command_stamp", -2, Reason.INVALID, "command_stamp must be at least -1 (got -2 ns)"),
        ("applied", "speeds[79]", -1.0, Reason.INVALID, "speeds must not be negative (got -1 rad/s)"),
        ("applied", "speeds[0]", NAN, Reason.INVALID, "speeds must be finite"),
        ("applied", "period.nanosec", 0, Reason.INVALID, "period must be positive (got 0 ns)"),
        ("status", "header.frame_id", "leader/base_link", Reason.FOREIGN, "frame_id"),
        ("status", "mode", 8, Reason.INVALID, "mode must be 0 to 7 (got 8)"),
    ],
)
def test_rejected(kind: str, path: str, value: Any, reason: Reason, says: str) -> None:
    make, take = KINDS[kind]
    message = make()
    change(message, path, value)
    with pytest.raises(RejectionError, match=re.escape(says)) as error:
        take(over_the_wire(message))
    assert error.value.reason is reason
    assert "\n" not in str(error.value)


def test_a_zero_quaternion_is_rejected() -> None:
    message = imu_message()
    message.orientation.x = message.orientation.y = message.orientation.z = message.orientation.w = 0.0
    with pytest.raises(RejectionError, match="got norm 0"):
        imu_wire.from_msg(message, NAME, TEAM)


def test_a_plan_with_an_incomplete_interval_is_rejected() -> None:
    message = command_message()
    message.predicted_speeds.pop()
    with pytest.raises(RejectionError, match=re.escape("must hold 4 per interval (got 55)")):
        commands.rotor_command_from_msg(over_the_wire(message), NAME)


def test_an_acknowledgement_of_an_incomplete_interval_is_rejected() -> None:
    message = applied_message()
    message.speeds.pop()
    with pytest.raises(RejectionError, match=re.escape("speeds must hold 4 per interval (got 79)")):
        applied_wire.from_msg(over_the_wire(message), NAME, TEAM)


def test_more_intervals_than_are_ever_acknowledged_are_rejected() -> None:
    message = applied_message()
    message.speeds = [501.5] * 84
    with pytest.raises(RejectionError, match=re.escape("at most 20 intervals (got 84 numbers)")):
        applied_wire.from_msg(over_the_wire(message), NAME, TEAM)


def test_correlations_that_no_covariance_has_are_rejected() -> None:
    message = bearings_message()
    covariance = np.array([[1.0, 0.9, 0.3], [0.9, 1.0, -0.9], [0.3, -0.9, 1.0]])
    message.observations[1].covariance = covariance.reshape(-1)
    with pytest.raises(RejectionError, match="must be symmetric and positive semidefinite"):
        bearings_wire.from_msg(over_the_wire(message), NAME, TEAM)


@pytest.mark.parametrize("cut", [0, 1, 3, 11, 20, 33, 100])
def test_bytes_that_are_no_message_are_rejected(cut: int) -> None:
    data = serialize_message(odometry_message())[:cut]
    with pytest.raises(RejectionError, match=f"{cut} bytes cannot be decoded") as error:
        odometry_wire.odometry_from_data(data, NAME)
    assert error.value.reason is Reason.INVALID


@given(st.binary(max_size=800))
def test_any_bytes_are_an_odometry_or_rejected(data: bytes) -> None:
    with contextlib.suppress(RejectionError):
        odometry_wire.odometry_from_data(data, NAME)
    with contextlib.suppress(RejectionError):
        assert raw_stamp_ns(data) >= 0


def test_what_a_stranger_sent_is_quoted_in_one_short_line() -> None:
    message = imu_message()
    message.header.frame_id = "line\n" * 10_000
    with pytest.raises(RejectionError, match="frame_id must be") as error:
        imu_wire.from_msg(over_the_wire(message), NAME, TEAM)
    assert len(str(error.value)) <= EXPLANATION_MAX
    assert str(error.value).isprintable()


def test_the_rates_of_an_optic_flow_are_marked_as_not_measured() -> None:
    message = flow_message()
    covariance = np.reshape(message.twist.covariance, (6, 6))
    assert np.all(covariance.diagonal()[3:] >= 1e6)
    assert np.all(covariance[:3, 3:] == 0.0)


@pytest.mark.parametrize(
    "source", [*SENSORS, APPLIED_ROTOR_SPEEDS, FLIGHT_STATUS], ids=lambda source: source.name
)
def test_all_that_vehicles_send_has_a_message_and_conversions(source: Source[Any]) -> None:
    conversion = wire(source)
    assert serialize_message(conversion.MESSAGE())
    assert list(inspect.signature(conversion.from_msg).parameters) == ["msg", "vehicle", "team"]
    assert len(inspect.signature(conversion.to_msg).parameters) == 2
