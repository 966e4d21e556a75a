"""Position and velocity of a vehicle by its own sensors.

Axes are those of the IMU's world frame {n}: its z is the vertical, its yaw is off by an unknown constant on a
follower and drifts slowly. Horizontally the origin is where the vehicle last stood on the ground.
"""

import math

import numpy as np

from relform_core.arrays import Array
from relform_core.rotation import rotation_matrix
from relform_core.sensors.sonar import Sonar
from relform_core.units import GRAVITY
from relform_sim.axis_filter import AxisFilter
from relform_sim.landmarks import Landmarks
from relform_sim.pilot import Readings

MODEL_STD = 0.05
"""Acceleration that neither the accelerometer nor its sampling explains, in gentle flight [m/s^2]."""
AGILE_STD = 1.0
"""The same while the controller flies [m/s^2]."""
SONAR_STD = 0.03
"""Of the measured height [m]; a range message does not say."""


class OwnMotion:
    """The estimate.

    Args:
        period: between two readings [s].
        leg_height: height of the vehicle on the ground [m].
        start_height: where it hovers at first, if it has not stood on the ground before [m]; the sonar knows
            better.
    """

    def __init__(self, period: float, leg_height: float, start_height: float) -> None:
        self._period = period
        self._leg_height = leg_height
        self._start_height = start_height
        self._axes = (AxisFilter(), AxisFilter(), AxisFilter())
        self._landmarks = Landmarks()
        self._before: Array | None = None
        """The attitude of the last readings."""
        self.R_NB = np.eye(3)
        """The present attitude."""

    @property
    def p_N(self) -> Array:
        """Position, its height above the ground [m], shape (3,)."""
        return np.array([axis.position for axis in self._axes])

    @property
    def v_N(self) -> Array:
        """Velocity [m/s], shape (3,)."""
        return np.array([axis.velocity for axis in self._axes])

    def rest(self, readings: Readings) -> None:
        """The vehicle stands on the ground: a new origin."""
        self.R_NB = rotation_matrix(readings.imu.q_NB)
        self._before = self.R_NB
        for axis, position in zip(self._axes, (0.0, 0.0, self._leg_height), strict=True):
            axis.reset(position)
        self._landmarks.settle(readings, self.R_NB, np.zeros(2))

    def move(self, readings: Readings, *, is_agile: bool, has_landmarks: bool) -> None:
        """Take in the readings one period after the last ones.

        Args:
            readings: of the vehicle.
            is_agile: whether the controller flies.
            has_landmarks: whether its neighbours hold their places.
        """
        imu, optic_flow, sonar = readings.imu, readings.optic_flow, readings.sonar
        if self._before is None:  # the vehicle starts in the air
            is_seen = math.isfinite(sonar.range)
            self._axes[2].reset(sonar.range if is_seen else self._start_height)
        self.R_NB = rotation_matrix(imu.q_NB)
        # The force of the interval, in the body frame as it is at its end, turned with the mean attitude.
        mean = self.R_NB if self._before is None else 0.5 * (self._before + self.R_NB)
        self._before = self.R_NB
        accelerations = mean @ imu.f_NB_B - np.array([0.0, 0.0, GRAVITY])
        std = math.hypot(
            AGILE_STD if is_agile else MODEL_STD, math.sqrt(float(imu.accelerometer_covariance[0, 0]))
        )
        velocities = self.R_NB @ optic_flow.v_NB_B
        variance = float(optic_flow.covariance[0, 0])
        for axis, acceleration, velocity in zip(self._axes, accelerations, velocities, strict=True):
            axis.predict(float(acceleration), std, self._period)
            axis.measure_velocity(float(velocity), variance)
        self._measure_height(sonar)
        if not has_landmarks:
            self._landmarks.forget()
            return
        for place, place_variance in self._landmarks.places(readings, self.R_NB, self.p_N[:2]):
            for axis, coordinate in zip(self._axes[:2], place, strict=True):
                axis.measure_position(float(coordinate), place_variance)

    def _measure_height(self, sonar: Sonar) -> None:
        """Also by what no range is: the vehicle is below the least range, and never below the ground."""
        height = self._axes[2]
        if math.isfinite(sonar.range):
            height.measure_position(sonar.range, SONAR_STD**2)
        elif sonar.range < 0.0 and height.position > sonar.range_min:
            height.measure_position(sonar.range_min, SONAR_STD**2)
        if height.position < self._leg_height:
            height.measure_position(self._leg_height, SONAR_STD**2)
