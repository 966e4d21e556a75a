"""The lag of the rotors: which thrusts c_T w^2 of eq. Aerodynamics act when others are commanded.

The thrust T of a rotor follows its command u with a time constant: time_constant * T' = u - T. Commands are
constant over intervals. With e = exp(-h / time_constant), an interval of length h that starts with T ends
with (1 - e) u + e T. With m = (1 - e) * time_constant / h, the mean thrust in it is (1 - m) u + m T.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from relform_controller.ocp import layout
from relform_core.arrays import Array


@dataclass(frozen=True)
class RotorLag:
    """First-order lag of every rotor. Its functions work on arrays of any shape, for instance of a team."""

    time_constant: float
    """[s]; 0: no lag. Every function then returns the commands as they are."""

    def after(self, thrusts: Array, commanded: Array, time: float) -> Array:
        """Thrusts some time after a new command.

        Args:
            thrusts: at the instant of the command [N].
            commanded: [N], of the same shape.
            time: since then [s].
        """
        if self.time_constant == 0.0:
            return commanded
        return commanded + math.exp(-time / self.time_constant) * (thrusts - commanded)

    def mean(self, thrusts: Array, commanded: Array, duration: float) -> Array:
        """Mean thrusts over an interval of constant commands; arguments as in ``after``."""
        if self.time_constant == 0.0:
            return commanded
        return commanded + _memory(self.time_constant, duration) * (thrusts - commanded)

    def over_horizon(self, n_stages: int, stage: float) -> "HorizonLag | None":
        """The mean thrusts of a horizon's stages, each ``stage`` seconds long; None: there is no lag."""
        return None if self.time_constant == 0.0 else _over_horizon(self.time_constant, n_stages, stage)


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


@dataclass(frozen=True, eq=False)
class HorizonLag:
    """Mean thrusts in the stages of a horizon, a linear map of the commands and of the thrusts at its start.

    All own mean thrusts of a vehicle, stage by stage, are ``by_commands`` times all its commands plus
    ``by_start`` times its thrusts at the start.
    """

    by_commands: Array
    """Shape (N * N_INPUT, N * N_INPUT), lower triangular."""
    by_start: Array
    """Shape (N * N_INPUT, N_INPUT)."""

    def mean_thrusts(self, commands: Array, start: Array) -> Array:
        """Mean thrusts [N], shape (vehicle, stage, N_INPUT).

        Args:
            commands: [N], shape (vehicle, stage, N_INPUT).
            start: thrusts at the start of the horizon [N], shape (vehicle, N_INPUT).
        """
        own = commands.reshape(len(commands), -1)
        mean: Array = own @ self.by_commands.T + start @ self.by_start.T
        return mean.reshape(commands.shape)


def _memory(time_constant: float, duration: float) -> float:
    """Weight m of the thrust at the start in the mean over an interval."""
    return -math.expm1(-duration / time_constant) * time_constant / duration


@cache
def _over_horizon(time_constant: float, n_stages: int, stage: float) -> HorizonLag:
    m, e = _memory(time_constant, stage), math.exp(-stage / time_constant)
    stages = np.arange(n_stages)
    later = np.subtract.outer(stages, stages) - 1
    by_commands, by_start = np.zeros((n_stages, n_stages)), np.zeros((n_stages, 1))
    by_commands[stages, stages] = 1.0 - m
    by_commands[later >= 0] = m * (1.0 - e) * e ** later[later >= 0]
    by_start[:, 0] = m * e**stages
    each = np.eye(layout.N_INPUT)
    lag = HorizonLag(*(np.kron(by, each).astype(np.float64) for by in (by_commands, by_start)))
    lag.by_commands.flags.writeable = lag.by_start.flags.writeable = False  # every call returns the same
    return lag
