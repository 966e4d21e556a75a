"""Arrays as text, for the data of a page."""

import base64

import numpy as np
import numpy.typing as npt

from relform_analysis.flight.summary import Json

UNKNOWN = -32768
"""NaN, in whole numbers of 16 bits."""


def pack(values: npt.ArrayLike) -> Json:
    """An array for the page: its shape, and its values as little-endian float32 in base64."""
    array = np.asarray(values).astype("<f4", order="C")
    return {"shape": list(array.shape), "float32": base64.b64encode(array.tobytes()).decode("ascii")}


def pack_coarsely(values: npt.ArrayLike) -> Json:
    """An array in half of the space, rounded to a 65 534th of the range of its values; NaN stays NaN."""
    array = np.asarray(values, dtype=np.float64)
    finite = array[np.isfinite(array)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    middle, step = (low + high) / 2.0, (high - low) / 65534.0
    counts = np.round((array - middle) / step) if step else 0.0 * array
    counts = np.where(np.isfinite(array), counts, UNKNOWN).astype("<i2", order="C")
    packed = base64.b64encode(counts.tobytes()).decode("ascii")
    return {"shape": list(array.shape), "middle": middle, "step": step, "int16": packed}
