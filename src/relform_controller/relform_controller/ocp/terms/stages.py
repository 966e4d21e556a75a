"""Weights along the horizon."""

import numpy as np

from relform_core.arrays import Array
from relform_core.controller_config import WeightsConfig


def with_terminal_scale(weight: float, weights: WeightsConfig, n_stages: int) -> Array:
    """One weight at stages 1..N, scaled at the last one; shape (stage,)."""
    scale = np.ones(n_stages)
    scale[-1] = weights.terminal_scale
    scaled: Array = weight * scale
    return scaled
