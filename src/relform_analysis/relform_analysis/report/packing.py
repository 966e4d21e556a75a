"""Arrays as text, for the data of a page."""

import base64

import numpy as np
import numpy.typing as npt

from relform_analysis.flight.summary import Json


def pack(values: npt.ArrayLike) -> Json:
    """An array for the page: its shape, and its values as little-endian float32 in base64."""
    array = np.asarray(values).astype("<f4", order="C")
    return {"shape": list(array.shape), "float32": base64.b64encode(array.tobytes()).decode("ascii")}
