"""Random states and inputs of one vehicle, far from hover."""

import numpy as np

from relform_controller.ocp import layout
from relform_core.arrays import Array


def random_state(generator: np.random.Generator, rate_max: float = 6.0, tilt_max: float = 1.0) -> Array:
    """Anywhere, at up to 4 m/s, at any yaw, tilted and turning; shape (N_STATE,)."""
    state = np.empty(layout.N_STATE)
    state[layout.POSITION] = generator.uniform(-3.0, 3.0, 3)
    state[layout.VELOCITY] = generator.uniform(-4.0, 4.0, 3)
    state[layout.RPY] = generator.uniform(-1.0, 1.0, 3) * [tilt_max, tilt_max, np.pi]
    state[layout.RATE] = generator.uniform(-rate_max, rate_max, 3)
    return state


def random_thrusts(generator: np.random.Generator, lowest: float = 0.2, highest: float = 3.2) -> Array:
    """Of the four rotors [N], shape (N_INPUT,)."""
    return generator.uniform(lowest, highest, layout.N_INPUT)
