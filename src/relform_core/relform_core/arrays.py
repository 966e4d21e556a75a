"""The array type of the whole workspace."""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
"""Double precision; shapes and units are told where it is used."""
