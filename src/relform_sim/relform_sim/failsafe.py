"""What a vehicle without ground below flies without a plan: first a hover, later a descent."""

import numpy as np

from relform_core.arrays import Array
from relform_core.flight_modes import VehicleMode
from relform_core.sensors.imu import Imu
from relform_core.sensors.optic_flow import OpticFlow
from relform_core.units import GRAVITY
from relform_core.vehicle_config import VehicleConfig
from relform_sim.pilot import Readings
from relform_sim.tilt_control import TiltControl, up_direction

CLIMB_GAIN = 3.0
"""Vertical acceleration per error of the vertical speed [1/s]."""
BRAKING_GAIN = 1.0
"""Horizontal acceleration against the horizontal speed in a hover [1/s]."""


class Failsafe:
    """Tilt and vertical speed, with the speed of the optic flow (``Pilot``).

    The yaw of the IMU is not used: on a follower it has an unknown offset.
    """

    def __init__(self, config: VehicleConfig, period: float) -> None:
        """Nominal vehicle, and the time between two calls [s]."""
        self.failsafe_speed = config.failsafe.descent_speed
        """See ``Pilot``."""
        self.is_up = False
        """It does not take off."""
        self.is_down = False
        """Whether the last interval of the failsafe began below the range of the sonar."""
        self._tilt_control = TiltControl(config, period)
        self._readings: Readings | None = None

    def sense(self, readings: Readings, mode: VehicleMode, applied: Array) -> None:
        """See ``Pilot``."""
        self._readings = readings

    def rotor_speeds(self, mode: VehicleMode) -> Array:
        """See ``Pilot``; FAILSAFE sinks, any other mode hovers."""
        assert self._readings is not None
        imu, optic_flow, sonar = self._readings.imu, self._readings.optic_flow, self._readings.sonar
        if mode is not VehicleMode.FAILSAFE:
            return self.hover(imu, optic_flow)
        self.is_down = sonar.range <= sonar.range_min
        return self.sink(imu, optic_flow)

    def sink(self, imu: Imu, optic_flow: OpticFlow) -> Array:
        """Level out and sink slowly; the horizontal velocity is not controlled.

        Returns:
            Rotor speeds front, left, back, right, possibly beyond the limits [rad/s], shape (4,).
        """
        return self._fly(imu, optic_flow, up_direction(imu.q_NB), -self.failsafe_speed)

    def hover(self, imu: Imu, optic_flow: OpticFlow) -> Array:
        """Brake to zero velocity. Returns rotor speeds as ``sink`` does."""
        up_B = up_direction(imu.q_NB)
        horizontal_B = optic_flow.v_NB_B - up_B * (up_B @ optic_flow.v_NB_B)
        force_B = GRAVITY * up_B - BRAKING_GAIN * horizontal_B  # per mass
        return self._fly(imu, optic_flow, force_B / np.linalg.norm(force_B), climb_speed=0.0)

    def _fly(self, imu: Imu, optic_flow: OpticFlow, thrust_B: Array, climb_speed: float) -> Array:
        """Turn body z towards a direction, shape (3,), and settle at a vertical speed [m/s]."""
        climb = float(up_direction(imu.q_NB) @ optic_flow.v_NB_B)
        return self._tilt_control.rotor_speeds(imu, thrust_B, CLIMB_GAIN * (climb_speed - climb))
