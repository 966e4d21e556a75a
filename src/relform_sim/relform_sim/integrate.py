"""Integration of ordinary differential equations with fixed steps.

States are tuples of floats: for a dozen numbers, plain Python is ten times as fast as small numpy arrays.
"""

from collections.abc import Callable

State = tuple[float, ...]
Derivative = Callable[[float, State], State]
"""Time [s] and state to the rate of the state."""


def rk4_step(derivative: Derivative, time: float, state: State, step: float) -> State:
    """State at ``time + step``, by the classical Runge-Kutta method of order 4."""
    half, sixth = step / 2.0, step / 6.0
    k1 = derivative(time, state)
    k2 = derivative(time + half, tuple([x + half * k for x, k in zip(state, k1, strict=True)]))
    k3 = derivative(time + half, tuple([x + half * k for x, k in zip(state, k2, strict=True)]))
    k4 = derivative(time + step, tuple([x + step * k for x, k in zip(state, k3, strict=True)]))
    return tuple(
        [x + sixth * (a + 2.0 * (b + c) + d) for x, a, b, c, d in zip(state, k1, k2, k3, k4, strict=True)]
    )
