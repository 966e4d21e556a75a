"""Colours and text styles that all figures share."""

from typing import Any

from relform_analysis.plots.palette import SERIES, VEHICLES, Style, inks

VEHICLE_COLOURS = tuple(ink.light for ink in VEHICLES)
"""By place in the team."""
BLACK, VERMILION, BLUE, GREEN = (ink.light for ink in SERIES)
TEXT, GUIDE, SHADOW, BAND = "#555555", "#8A8A8A", "#C8C8C8", "#E9E9E9"
"""Greys of texts, of levels to compare with, of what lies behind, and of steady windows."""

COMMON: dict[Any, Any] = {"axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False}
SCREEN_STYLE: dict[Any, Any] = COMMON | {
    "font.size": 12.0,
    "axes.titlesize": 12.0,
    "axes.titlelocation": "left",
    "lines.linewidth": 1.4,
}
"""For ``matplotlib.rc_context``: figures for the screen."""
PAPER_STYLE: dict[Any, Any] = COMMON | {
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.titlelocation": "right",
    "pdf.fonttype": 42,  # text stays text
}
"""For ``matplotlib.rc_context``: figures for papers."""


def cycled(colours: tuple[str, ...], index: int) -> str:
    """A colour of a palette, which begins again after its last."""
    return colours[index % len(colours)]


def line_style(style: Style) -> dict[str, Any]:
    """What matplotlib's ``plot`` takes for a line."""
    return {"color": inks()[style.colour].light, "linestyle": (0, style.dash) if style.dash else "-"}
