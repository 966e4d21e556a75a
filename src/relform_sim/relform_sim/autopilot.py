"""Take-off, hover and landing of one vehicle on its own sensors.

A reference moves with limited acceleration from the state at which the autopilot takes over: horizontally to
a stop, vertically to the height of take-off, to a stop, or to the ground. The vehicle follows it. What pushes
it meanwhile (wind, a wrong mass) shows in its accelerometer and is countered.
"""

import math

import numpy as np

from relform_core.arrays import Array
from relform_core.flight_modes import VehicleMode
from relform_core.ground_config import GroundConfig
from relform_core.units import GRAVITY
from relform_core.vehicle_config import VehicleConfig
from relform_sim.own_motion import OwnMotion
from relform_sim.pilot import Readings
from relform_sim.tilt_control import TiltControl

POSITION_GAINS = np.array([1.2, 1.2, 4.0])
"""Acceleration per error of the position [1/s^2]."""
VELOCITY_GAINS = np.array([2.0, 2.0, 4.0])
"""Acceleration per error of the velocity [1/s]."""
REFERENCE_ACCELERATION = 1.5
"""Highest acceleration of the reference [m/s^2]."""
HORIZONTAL_ACCELERATION_MAX = 3.0
"""Bound on the horizontal acceleration [m/s^2], a tilt of 17 deg."""
APPROACH_GAIN = 1.5
"""Vertical speed of the reference per distance from its aim [1/s]: the smooth end of climb and descent."""
PUSH_TIME = 0.2
"""Time constant with which a push is found [s]."""
YAW_ERROR_MAX = 0.05
"""Bound on the error of the yaw that the rotors correct [rad]: their yaw torque is small."""

CLEAR_OF_GROUND = 0.1
"""Height above that at rest at which no leg touches, at the tilts of a take-off [m]."""
UP_TOLERANCE = 0.1
"""Distance from the height of take-off at which it is reached [m]."""
TOUCHDOWN_SPEED = 0.2
"""Vertical speed of the reference near and below the ground, downwards [m/s]."""
SETTLING = 1.5
"""Least acceleration downwards, once the reference is at the ground [m/s^2]: less thrust than weight."""
SUPPORT_MIN = 0.75
"""A vehicle near the ground that feels this much beside thrust and push is carried by the ground [m/s^2],"""
DOWN_TIME = 0.25
"""if it does for this time [s]."""
HOVER_HEIGHT_MIN = 0.4
"""Height above that at rest to which a vehicle climbs that is told to hover near the ground [m]."""

_SINKING = frozenset({VehicleMode.LANDING, VehicleMode.FAILSAFE})
_WITH_LANDMARKS = frozenset({VehicleMode.TAKING_OFF, VehicleMode.HOVERING, VehicleMode.LANDING})
"""Modes that a team enters and leaves together; FAILSAFE may be that of one vehicle alone."""


class Autopilot:
    """Flies TAKING_OFF, HOVERING, LANDING and FAILSAFE (``Pilot``); knows its place while the others last."""

    def __init__(self, config: VehicleConfig, period: float, ground: GroundConfig, height: float) -> None:
        """Nominal vehicle, time between two calls [s], how it takes off, and to which height [m]."""
        self.failsafe_speed = config.failsafe.descent_speed
        """See ``Pilot``."""
        self.is_up = self.is_down = False
        """See ``Pilot``."""
        self._vehicle = config
        self._period = period
        self._ground = ground
        self._height = height
        self._motion = OwnMotion(period, config.leg_height, height)
        self._tilt_control = TiltControl(config, period)
        self._readings: Readings | None = None
        self._push = np.zeros(3)
        """Acceleration of the vehicle that the rotors do not explain [m/s^2]."""
        self._mode: VehicleMode | None = None
        """That was flown in the last interval; None: another pilot flew."""
        self._p_ref, self._v_ref = np.zeros(3), np.zeros(3)
        self._yaw_ref = 0.0
        self._hover_height = height
        self._time_down = 0.0
        """For how long the ground has carried the vehicle [s]."""

    def sense(self, readings: Readings, mode: VehicleMode, applied: Array) -> None:
        """See ``Pilot``."""
        self._readings = readings
        if mode is not self._mode:  # nothing was flown by this pilot
            self._mode = None
        rest = self._vehicle.leg_height
        if mode in (VehicleMode.IDLE, VehicleMode.ARMED):
            self._motion.rest(readings)
            self._push = np.zeros(3)
            self.is_up = self.is_down = False
            return
        self._motion.move(
            readings, is_agile=mode is VehicleMode.FLYING, has_landmarks=mode in _WITH_LANDMARKS
        )
        height = float(self._motion.p_N[2])
        self.is_up = mode is VehicleMode.TAKING_OFF and abs(height - self._height) < UP_TOLERANCE
        is_low = readings.sonar.range < max(readings.sonar.range_min, rest + CLEAR_OF_GROUND)
        felt = self._felt(readings, applied)
        if not is_low:
            self._push += self._period / (PUSH_TIME + self._period) * (felt - self._push)
        support = float(felt[2] - self._push[2])
        stands = mode in _SINKING and is_low and support > SUPPORT_MIN
        self._time_down = self._time_down + self._period if stands else 0.0
        self.is_down = self._time_down >= DOWN_TIME

    def rotor_speeds(self, mode: VehicleMode) -> Array:
        """See ``Pilot``."""
        assert self._readings is not None
        R_NB = self._motion.R_NB
        yaw = math.atan2(R_NB[1, 0], R_NB[0, 0])
        if self._mode is None:
            self._p_ref, self._v_ref, self._yaw_ref = self._motion.p_N, self._motion.v_N, yaw
        if mode is not self._mode and mode is VehicleMode.HOVERING:
            self._hover_height = self._stopping_height()
        self._mode = mode
        acceleration = self._move_reference(mode)
        acceleration += POSITION_GAINS * (self._p_ref - self._motion.p_N)
        acceleration += VELOCITY_GAINS * (self._v_ref - self._motion.v_N)
        if mode in _SINKING and self._p_ref[2] <= self._vehicle.leg_height:
            acceleration[2] = min(acceleration[2], -SETTLING)
        acceleration -= self._push
        sideways = math.hypot(acceleration[0], acceleration[1])
        if sideways > HORIZONTAL_ACCELERATION_MAX:
            acceleration[:2] *= HORIZONTAL_ACCELERATION_MAX / sideways
        upwards = max(float(acceleration[2]), -0.8 * GRAVITY)
        thrust_B = R_NB.T @ np.array([acceleration[0], acceleration[1], GRAVITY + upwards])
        turn = math.remainder(self._yaw_ref - yaw, math.tau)
        return self._tilt_control.rotor_speeds(
            self._readings.imu, thrust_B, upwards, max(-YAW_ERROR_MAX, min(YAW_ERROR_MAX, turn))
        )

    def _felt(self, readings: Readings, applied: Array) -> Array:
        """What the accelerometer feels beside the thrust of the interval before [m/s^2], shape (3,)."""
        thrust = self._vehicle.thrust_coefficient * float(applied @ applied) / self._vehicle.mass
        felt: Array = self._motion.R_NB @ (readings.imu.f_NB_B - np.array([0.0, 0.0, thrust]))
        return felt

    def _move_reference(self, mode: VehicleMode) -> Array:
        """Move the reference by one period. Returns its acceleration [m/s^2], shape (3,)."""
        change = np.array([0.0, 0.0, self._aimed_climb(mode)]) - self._v_ref
        size, most = float(np.linalg.norm(change)), REFERENCE_ACCELERATION * self._period
        if size > most:
            change *= most / size
        self._p_ref = self._p_ref + self._period * (self._v_ref + 0.5 * change)
        self._v_ref = self._v_ref + change
        acceleration: Array = change / self._period
        return acceleration

    def _aimed_climb(self, mode: VehicleMode) -> float:
        """Vertical speed to which the reference accelerates [m/s]."""
        height = float(self._p_ref[2])
        if mode in _SINKING:
            speed = self._ground.descent_speed if mode is VehicleMode.LANDING else self.failsafe_speed
            return -max(_approach(height - self._vehicle.leg_height, speed), min(speed, TOUCHDOWN_SPEED))
        aim = self._height if mode is VehicleMode.TAKING_OFF else self._hover_height
        return math.copysign(_approach(abs(aim - height), self._ground.climb_speed), aim - height)

    def _stopping_height(self) -> float:
        """Where to hover: at the height of take-off if it has just been reached, else where it stops."""
        if self.is_up:
            return self._height
        climb = float(self._v_ref[2])
        stop = float(self._p_ref[2]) + climb * abs(climb) / (2.0 * REFERENCE_ACCELERATION)
        return max(stop, self._vehicle.leg_height + HOVER_HEIGHT_MIN)


def _approach(distance: float, speed: float) -> float:
    """Speed at a distance from the aim, from which half the acceleration of the reference stops in time."""
    distance = max(0.0, distance)
    return min(speed, APPROACH_GAIN * distance, math.sqrt(REFERENCE_ACCELERATION * distance))
