"""The array types of the whole workspace."""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
"""Double precision; shapes and units are named where it is used."""

Integers = npt.NDArray[np.int64]
"""Whole numbers, such as instants in nanoseconds."""

Mask = npt.NDArray[np.bool_]
"""True where something holds."""
