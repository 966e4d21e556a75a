"""Title and legend above a plot for papers: both off the curves."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING, Any

from relform_analysis.plots.style import TEXT

if TYPE_CHECKING:  # matplotlib takes a second to import
    from matplotlib.axes import Axes

LINE_IN = 0.16
"""Height of a line of text."""
LINE_LENGTH = 104
"""Characters of a line of a legend, its signs included."""
SIGN = 6
"""Room of the sign of an entry, in characters."""


@dataclass(frozen=True)
class Heading:
    """What stands above a plot."""

    title: str
    handles: tuple[Any, ...]
    labels: tuple[str, ...]

    @property
    def columns(self) -> int:
        """Entries of a line."""
        longest = max(map(len, self.labels), default=1) + SIGN
        return max(1, min(len(self.labels), LINE_LENGTH // longest))

    @property
    def is_beside_title(self) -> bool:
        """Whether the legend has room in the line of the title."""
        return len(self.title) + sum(len(label) + SIGN for label in self.labels) <= LINE_LENGTH

    @property
    def lines(self) -> int:
        """Lines of text."""
        if not self.labels or self.is_beside_title:
            return 1
        return 1 + ceil(len(self.labels) / self.columns)


def heading_height_in(heading: Heading) -> float:
    """Height [in]."""
    return LINE_IN * heading.lines


def draw_heading(axes: Axes, heading: Heading, plot_in: float, above_in: float) -> None:
    """Draw it.

    Args:
        plot_in: height of the plot [in].
        above_in: room between plot and heading [in].
    """
    beside = heading.is_beside_title or not heading.labels
    below_title_in = above_in + (0.0 if beside else heading_height_in(heading) - LINE_IN)
    axes.set_title(heading.title, color=TEXT, pad=72.0 * (0.04 + below_title_in))
    if heading.labels:
        axes.legend(
            heading.handles,
            heading.labels,
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0 + above_in / plot_in),
            ncols=len(heading.labels) if beside else heading.columns,
            borderaxespad=0.0,
            borderpad=0.2,
            labelspacing=0.25,
            columnspacing=1.2,
            handlelength=2.6,
        )
