"""The true quadrotor: its state (eq. StateDef), moved through time under rotor commands and disturbances."""

import numpy as np

from relform_core.arrays import Array
from relform_core.measurements import Odometry
from relform_core.schema import Vector3
from relform_core.units import GRAVITY
from relform_sim.contact import touches
from relform_sim.integrate import State
from relform_sim.motion import Inputs
from relform_sim.motion_kernel import make_motion
from relform_sim.rigid_body import (
    ALL_WHOLE,
    Body,
    lagged_speeds,
    rigid_body_rate,
    rotation_rows,
    rotor_wrench,
)

NO_WIND: Vector3 = (0.0, 0.0, 0.0)


class Plant:
    """One quadrotor, integrated with RK4 at a fixed step."""

    def __init__(
        self,
        body: Body,
        *,
        step: float,
        rotor_time_constant: float,
        rotor_speed: float,
        p_NB_N: Vector3,
        q_NB: State,
        v_NB_N: Vector3 = (0.0, 0.0, 0.0),
        w_NB_B: Vector3 = (0.0, 0.0, 0.0),
    ) -> None:
        """Initial state, and ``rotor_speed`` [rad/s] at which all rotors turn.

        Args:
            step: integration step [s].
            rotor_time_constant: first-order lag of the rotor speeds [s]; 0: none.
        """
        self._body = body
        self._step = step
        self._rotor_time_constant = rotor_time_constant
        self._motion = make_motion(body, step, rotor_time_constant)
        self._state: State = (*p_NB_N, *v_NB_N, *q_NB, *w_NB_B)
        self._R_NB = np.array(rotation_rows(self._state[6:10]))
        self._rotor_speeds: State = (rotor_speed,) * 4
        self._inputs = Inputs(self._rotor_speeds, self._rotor_speeds, NO_WIND, 1.0)
        """Of the last interval."""

    def advance(
        self,
        commanded: State,
        duration: float,
        *,
        wind_N: Vector3 = NO_WIND,
        thrust_scale: float = 1.0,
        rotor_scales: State = ALL_WHOLE,
    ) -> None:
        """Integrate over ``duration`` [s], a multiple of the step, with all inputs constant.

        Args:
            commanded: rotor speeds front, left, back, right [rad/s].
            wind_N: external force in the world frame [N].
            thrust_scale: factor on thrust and torque of every rotor.
            rotor_scales: a further one for each rotor.
        """
        self._inputs = Inputs(self._rotor_speeds, commanded, wind_N, thrust_scale, rotor_scales)
        self._state = self._motion.after(round(duration / self._step), self._state, self._inputs)
        self._R_NB = np.array(rotation_rows(self._state[6:10]))
        self._rotor_speeds = lagged_speeds(self._rotor_speeds, commanded, duration, self._rotor_time_constant)

    def odometry(self, stamp_ns: int) -> Odometry:
        """The true state, stamped."""
        state = np.array(self._state)
        return Odometry(
            stamp_ns=stamp_ns,
            p_NB_N=state[0:3],
            q_NB=state[6:10],
            v_NB_B=self._R_NB.T @ state[3:6],
            w_NB_B=state[10:13],
            pose_covariance=np.zeros((6, 6)),
            twist_covariance=np.zeros((6, 6)),
        )

    @property
    def touches_ground(self) -> bool:
        """Whether a leg is on the ground; false where there is none."""
        legs = self._body.legs
        return legs is not None and touches(legs, self._state[2], rotation_rows(self._state[6:10]))

    def specific_force(self) -> Array:
        """True f_NB_B [m/s^2], shape (3,), at the end of the last interval and under its inputs."""
        inputs = self._inputs
        wrench = rotor_wrench(self._body, self._rotor_speeds, inputs.thrust_scale, inputs.rotor_scales)
        rate = rigid_body_rate(self._body, wrench, inputs.wind_N, self._state)
        gravity_N = np.array([0.0, 0.0, -GRAVITY])
        f_NB_B: Array = self._R_NB.T @ (np.array(rate[3:6]) - gravity_N)
        return f_NB_B
