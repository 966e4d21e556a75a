"""The motion of a vehicle over an interval with constant inputs: the reference, which the C code equals.

``motion_kernel`` does the same operations in the same order, so that a flight is the same, bit for bit, with
and without a C compiler.
"""

import math
from typing import NamedTuple, Protocol

from relform_core.schema import Vector3
from relform_sim.integrate import State, rk4_step
from relform_sim.rigid_body import ALL_WHOLE, Body, Wrench, lagged_speeds, rigid_body_rate, rotor_wrench


class Inputs(NamedTuple):
    """What acts on a vehicle during one interval."""

    rotor_speeds: State
    """At its start [rad/s]."""
    commanded: State
    """Rotor speeds that the rotors approach [rad/s]."""
    wind_N: Vector3
    """External force in the world frame [N]."""
    thrust_scale: float
    """Factor on thrust and torque of every rotor."""
    rotor_scales: State = ALL_WHOLE
    """A further one for each rotor."""


class Motion(Protocol):
    """Moves the state of one vehicle: p_NB_N, v_NB_N, q_NB, w_NB_B, 13 numbers."""

    def after(self, n_steps: int, state: State, inputs: Inputs) -> State:
        """The state after some integration steps.

        Args:
            n_steps: how many.
            state: the one before.
            inputs: in force meanwhile.
        """


class ReferenceMotion:
    """The motion in Python (``Motion``).

    Args:
        body: the true vehicle.
        step: of the integration by RK4 [s].
        rotor_time_constant: first-order lag of the rotor speeds [s]; 0: none.
    """

    def __init__(self, body: Body, step: float, rotor_time_constant: float) -> None:
        self._body = body
        self._step = step
        self._rotor_time_constant = rotor_time_constant

    def after(self, n_steps: int, state: State, inputs: Inputs) -> State:
        """See ``Motion``."""
        rotor_speeds, commanded, wind_N, thrust_scale, rotor_scales = inputs
        steady = rotor_wrench(self._body, commanded, thrust_scale, rotor_scales)

        def wrench(time: float) -> Wrench:
            if self._rotor_time_constant == 0.0:
                return steady
            speeds = lagged_speeds(rotor_speeds, commanded, time, self._rotor_time_constant)
            return rotor_wrench(self._body, speeds, thrust_scale, rotor_scales)

        def rate(time: float, state: State) -> State:
            return rigid_body_rate(self._body, wrench(time), wind_N, state)

        for i in range(n_steps):
            state = _normalized(rk4_step(rate, i * self._step, state, self._step))
        return state


def _normalized(state: State) -> State:
    """The state with a unit quaternion: integration keeps its length only to the order of the method."""
    x, y, z, w = state[6:10]
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return (*state[0:6], x / length, y / length, z / length, w / length, *state[10:13])
