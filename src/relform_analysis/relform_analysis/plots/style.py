"""Colours and text styles that all figures share."""

from typing import Any

BLACK, VERMILION, BLUE, GREEN, PURPLE, ORANGE, SKY_BLUE = (
    "#222222",
    "#D55E00",
    "#0072B2",
    "#009E73",
    "#CC79A7",
    "#E69F00",
    "#56B4E9",
)
"""The palette of Okabe and Ito: its colours differ for any colour vision."""
VEHICLE_COLOURS = (BLACK, VERMILION, BLUE, GREEN, PURPLE, ORANGE, SKY_BLUE)
PAIR_COLOURS = (*VEHICLE_COLOURS[1:], BLACK)
LINE_COLOURS = {
    "vehicle": VEHICLE_COLOURS,
    "pair": PAIR_COLOURS,
    "rotor": (VERMILION, BLUE, GREEN, PURPLE),
    "series": (BLACK, VERMILION),
}
"""By the first part of ``Line.colour``."""
TEXT, GUIDE, SHADOW, BAND = "#555555", "#8A8A8A", "#C8C8C8", "#E9E9E9"
"""Greys of texts, of levels to compare with, of what lies behind, and of steady windows."""

COMMON: dict[Any, Any] = {"axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False}
SCREEN_STYLE: dict[Any, Any] = COMMON | {
    "font.size": 12.0,
    "axes.titlesize": 13.0,
    "axes.titlelocation": "left",
    "lines.linewidth": 1.4,
}
"""For ``matplotlib.rc_context``: figures for the screen."""
PAPER_STYLE: dict[Any, Any] = COMMON | {
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.titlelocation": "right",
    "legend.fontsize": 7.0,
    "pdf.fonttype": 42,  # text stays text
}
"""For ``matplotlib.rc_context``: figures for papers."""


def cycled(colours: tuple[str, ...], index: int) -> str:
    """A colour of a palette, which begins again after its last."""
    return colours[index % len(colours)]
