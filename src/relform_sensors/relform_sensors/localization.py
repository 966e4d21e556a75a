"""Pose in the world frame, for the leader only."""

from collections.abc import Sequence

import numpy as np

from relform_core.events_config import LocalizationJump
from relform_core.measurements import UNMEASURED_VARIANCE, Odometry
from relform_core.rotation import quaternion_from_rotation_vector, quaternion_product
from relform_core.sensors.localization import LocalizationConfig
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_sensors.model import Carrier, Read


class LocalizationSensor:
    """Absolute position, velocity and attitude, with the same error about all axes; no rates."""

    def __init__(
        self,
        config: LocalizationConfig,
        generator: np.random.Generator,
        jumps: Sequence[LocalizationJump] = (),
    ) -> None:
        self._config = config
        self._jumps = tuple(jumps)
        self._generator = generator
        self._pose_covariance = np.diag([config.position_std**2] * 3 + [config.yaw_std**2] * 3)
        self._twist_covariance = np.diag([config.velocity_std**2] * 3 + [UNMEASURED_VARIANCE] * 3)

    def read(self, truth: Odometry) -> Odometry:
        """Localize the vehicle with this true state."""
        position_noise, velocity_noise, rotation_noise = self._generator.standard_normal((3, 3))
        time = truth.stamp_ns / NANOSECONDS_PER_SECOND
        offset_N = sum((np.array(jump.offset_N) for jump in self._jumps if jump.active(time)), np.zeros(3))
        q_noise = quaternion_from_rotation_vector(self._config.yaw_std * rotation_noise)
        return Odometry(
            stamp_ns=truth.stamp_ns,
            p_NB_N=truth.p_NB_N + self._config.position_std * position_noise + offset_N,
            q_NB=quaternion_product(truth.q_NB, q_noise),
            v_NB_B=truth.v_NB_B + self._config.velocity_std * velocity_noise,
            w_NB_B=np.zeros(3),
            pose_covariance=self._pose_covariance,
            twist_covariance=self._twist_covariance,
        )


def mount(config: LocalizationConfig, generator: np.random.Generator, carrier: Carrier) -> Read:
    """The model on this vehicle."""
    jumps = [event for event in carrier.events if isinstance(event, LocalizationJump)]
    sensor = LocalizationSensor(config, generator, jumps)
    return lambda scene: sensor.read(scene.own)
