"""A true team in the world and its measurements, computed with SciPy, independently of the packages."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from relform_core.arrays import Array
from relform_core.measurements import Odometry, TeamMeasurements, VehicleMeasurements
from relform_core.sensors.imu import IMU, Imu
from relform_core.sensors.localization import LOCALIZATION
from relform_core.sensors.optic_flow import OPTIC_FLOW, OpticFlow
from relform_core.sensors.range_bearing import RANGE_BEARING, RangeBearing, RangeBearings
from relform_core.sensors.sonar import SONAR, Sonar

PERIOD_NS = 50_000_000
POSITION_STD = 0.025
GYRO_VARIANCE = 0.0027


@dataclass(frozen=True, eq=False)
class TrueVehicle:
    """The true state of one vehicle."""

    p_NB_N: Array
    attitude: Rotation
    """R_NB."""
    v_NB_N: Array
    w_NB_B: Array

    @property
    def yaw(self) -> float:
        return float(self.attitude.as_euler("ZYX")[0])

    @property
    def levelled(self) -> Rotation:
        """R_NC: from a frame with the vehicle's yaw, without its roll and pitch, to the world."""
        return Rotation.from_euler("z", self.yaw)

    def state_I(self) -> Array:
        """The state in the vehicle's own {mi}, shape (12,)."""
        _, pitch, roll = self.attitude.as_euler("ZYX")
        v_IB_I = self.levelled.inv().apply(self.v_NB_N)
        return np.concatenate([np.zeros(3), v_IB_I, [roll, pitch, 0.0], self.w_NB_B])


def random_team(
    generator: np.random.Generator, n_vehicles: int, tilt_max: float = 0.5, rate_max: float = 1.0
) -> tuple[TrueVehicle, ...]:
    """A team on a ring of about 1.5 m, anywhere, with any yaws, tilted, moving and turning."""
    centre = generator.uniform(-20.0, 20.0, 3)
    vehicles = []
    for index in range(n_vehicles):
        angle = 2.0 * np.pi * index / n_vehicles + generator.uniform(-0.2, 0.2)
        radius, height = generator.uniform(1.3, 1.7), generator.uniform(-0.4, 0.4)
        yaw, pitch, roll = generator.uniform(-1.0, 1.0, 3) * [np.pi, tilt_max, tilt_max]
        vehicles.append(
            TrueVehicle(
                p_NB_N=centre + np.array([radius * np.cos(angle), radius * np.sin(angle), height]),
                attitude=Rotation.from_euler("ZYX", [yaw, pitch, roll]),
                v_NB_N=generator.uniform(-1.0, 1.0, 3),
                w_NB_B=generator.uniform(-rate_max, rate_max, 3),
            )
        )
    return tuple(vehicles)


def relative_position_C(observer: TrueVehicle, target: TrueVehicle) -> Array:
    """p_B1B2_C1, shape (3,)."""
    return observer.levelled.inv().apply(target.p_NB_N - observer.p_NB_N)


def sight(observer: TrueVehicle, target: TrueVehicle, name: str, noise: Array | None = None) -> RangeBearing:
    """The measurement of one vehicle by another; noise: standard normal draws for its three numbers."""
    x, y, z = observer.attitude.inv().apply(target.p_NB_N - observer.p_NB_N)
    distance, azimuth = float(np.linalg.norm([x, y, z])), float(np.arctan2(y, x))
    elevation = float(np.arcsin(z / distance))
    std = POSITION_STD / np.array([1.0, distance * np.cos(elevation), distance])
    errors = np.zeros(3) if noise is None else std * noise
    return RangeBearing(
        name, distance + errors[0], azimuth + errors[1], elevation + errors[2], np.diag(std**2)
    )


def measure(
    team: Sequence[TrueVehicle],
    names: Sequence[str],
    step: int = 0,
    yaw_offsets: Sequence[float] | None = None,
    noise: np.random.Generator | None = None,
) -> TeamMeasurements:
    """Measurements of a team, leader first; ``yaw_offsets`` are those of the IMUs, the leader's included."""
    stamp_ns = step * PERIOD_NS
    offsets = np.zeros(len(team)) if yaw_offsets is None else yaw_offsets

    def draw(std: float) -> Array:
        return np.zeros(3) if noise is None else std * noise.standard_normal(3)

    by_vehicle = {}
    for index, (name, vehicle) in enumerate(zip(names, team, strict=True)):
        seen = {
            names[j]: sight(vehicle, target, names[j], draw(1.0))
            for j, target in enumerate(team)
            if j != index
        }
        v_NB_B = vehicle.attitude.inv().apply(vehicle.v_NB_N)
        localization = Odometry(
            stamp_ns=stamp_ns,
            p_NB_N=vehicle.p_NB_N + draw(0.02),
            q_NB=vehicle.attitude.as_quat(),
            v_NB_B=v_NB_B + draw(0.1),
            w_NB_B=np.zeros(3),
            pose_covariance=1e-4 * np.eye(6),
            twist_covariance=1e-2 * np.eye(6),
        )
        imu = Imu(
            stamp_ns=stamp_ns,
            q_NB=(Rotation.from_euler("z", offsets[index]) * vehicle.attitude).as_quat(),
            attitude_covariance=1e-6 * np.eye(3),
            w_NB_B=vehicle.w_NB_B + draw(GYRO_VARIANCE**0.5),
            gyro_covariance=GYRO_VARIANCE * np.eye(3),
            f_NB_B=np.array([0.0, 0.0, 9.81]),
            accelerometer_covariance=1e-2 * np.eye(3),
        )
        measured = [
            (IMU, imu),
            (OPTIC_FLOW, OpticFlow(stamp_ns, v_NB_B + draw(0.25), 0.0625 * np.eye(3))),
            (SONAR, Sonar(stamp_ns, float(vehicle.p_NB_N[2]), 0.2, 10.0, 0.5)),
            (RANGE_BEARING, RangeBearings(stamp_ns, seen)),
        ]
        if index == 0:
            measured.append((LOCALIZATION, localization))
        by_vehicle[name] = VehicleMeasurements.collect(measured)
    return TeamMeasurements(step, stamp_ns, by_vehicle)
