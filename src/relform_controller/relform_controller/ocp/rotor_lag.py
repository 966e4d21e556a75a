"""The lag of the rotors: which thrusts c_T w^2 of eq. Aerodynamics act when others are commanded.

The thrust T of a rotor follows its command u with a time constant: time_constant * T' = u - T. Commands are
constant over intervals. With e = exp(-h / time_constant), an interval of length h that starts with T ends
with (1 - e) u + e T. With m = (1 - e) * time_constant / h, the mean thrust in it is (1 - m) u + m T.
"""

import math
from dataclasses import dataclass

import numpy as np

from relform_core.arrays import Array


@dataclass(frozen=True)
class RotorLag:
    """First-order lag of every rotor. Its functions work on arrays of any shape, for instance of a team."""

    time_constant: float
    """[s]; 0: no lag. Every function then returns the commands as they are."""

    def decay(self, time: float) -> float:
        """e: what remains of a difference of the thrusts after some time [s]."""
        return 0.0 if self.time_constant == 0.0 else math.exp(-time / self.time_constant)

    def memory(self, duration: float) -> float:
        """m: weight of the thrust at the start in the mean over an interval [s]."""
        if self.time_constant == 0.0:
            return 0.0
        return -math.expm1(-duration / self.time_constant) * self.time_constant / duration

    def after(self, thrusts: Array, commanded: Array, time: float) -> Array:
        """Thrusts some time after a new command.

        Args:
            thrusts: at the instant of the command [N].
            commanded: [N], of the same shape.
            time: since then [s].
        """
        if self.time_constant == 0.0:
            return commanded
        return commanded + self.decay(time) * (thrusts - commanded)

    def sequence(self, thrusts: Array, commanded: Array, time: float) -> Array:
        """Thrusts before and after each of some intervals in a row.

        Args:
            thrusts: before the first one [N], shape (vehicle, N_INPUT).
            commanded: in each of them [N], shape (vehicle, interval, N_INPUT).
            time: length of each [s].
        Returns:
            Shape (vehicle, interval + 1, N_INPUT) [N].
        """
        found: Array = np.concatenate([thrusts[:, None], commanded], axis=1)
        if self.time_constant != 0.0:
            for k in range(commanded.shape[1]):
                found[:, k + 1] = self.after(found[:, k], commanded[:, k], time)
        return found

    def mean(self, thrusts: Array, commanded: Array, duration: float) -> Array:
        """Mean thrusts over an interval of constant commands; arguments as in ``after``."""
        if self.time_constant == 0.0:
            return commanded
        return commanded + self.memory(duration) * (thrusts - commanded)


@dataclass(frozen=True, eq=False)
class Rotors:
    """The rotors of a team at one instant."""

    lag: RotorLag
    thrusts: Array
    """[N], shape (vehicle, N_INPUT)."""

    def after(self, commanded: Array, time: float) -> "Rotors":
        """The rotors some time after a new command."""
        return Rotors(self.lag, self.lag.after(self.thrusts, commanded, time))

    def mean(self, commanded: Array, duration: float) -> Array:
        """Mean thrusts over an interval of constant commands [N], shape (vehicle, N_INPUT)."""
        return self.lag.mean(self.thrusts, commanded, duration)
