"""Colours of vehicles and errors, as (red, green, blue) from 0 to 255."""

import numpy as np
import numpy.typing as npt

from relform_analysis.plots.palette import VEHICLES
from relform_core.arrays import Array

Rgb = tuple[int, int, int]
Colours = npt.NDArray[np.uint8]

UNSEEN: Rgb = (128, 128, 128)
"""A link over which nothing is measured."""
TARGET: Rgb = (150, 150, 150)

_ERRORS_M = np.array([0.0, 0.05, 0.15, 0.4])
_ERROR_COLOURS = np.array([(38, 166, 154), (156, 204, 101), (255, 179, 0), (229, 57, 53)], dtype=np.float64)
"""Teal, green, amber and red at these errors."""


def of_vehicles(n_vehicles: int) -> Colours:
    """One colour per vehicle in team order, shape (vehicle, 3): those of reports on dark ground."""
    return np.array(
        [rgb(VEHICLES[index % len(VEHICLES)].dark) for index in range(n_vehicles)], dtype=np.uint8
    )


def of_errors(errors: Array) -> Colours:
    """Colours of errors [m], shape (error,) to (error, 3); grey where the error is NaN."""
    colours = np.stack([np.interp(errors, _ERRORS_M, channel) for channel in _ERROR_COLOURS.T], axis=-1)
    return np.where(np.isnan(errors)[:, None], UNSEEN, colours).astype(np.uint8)


def linear(colours: Colours) -> Colours:
    """The same colours with intensities that are proportional to light (IEC 61966-2-1)."""
    encoded = colours / 255.0
    light = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return np.round(255.0 * light).astype(np.uint8)


def rgb(colour: str) -> Rgb:
    """A colour from the notation of web pages, #rrggbb."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


def css(colour: npt.ArrayLike) -> str:
    """A colour in the notation of web pages."""
    red, green, blue = (int(channel) for channel in np.asarray(colour))
    return f"#{red:02x}{green:02x}{blue:02x}"
