"""The plot over time of which soft constraints were active."""

import numpy as np

from relform_analysis.flight.log import FlightLog
from relform_analysis.plots.palette import series_style
from relform_analysis.plots.panels import Line, Panel


def constraint_panels(log: FlightLog) -> list[Panel]:
    """One plot with a row for every constraint that was ever active; empty: none was."""
    lines = [
        Line(name, series_style(0), np.where(active, row + 1.0, np.nan))
        for row, (name, active) in enumerate(log.active_constraints.items())
    ]
    return [Panel("Active soft constraints", "", 0, lines, steps=True)] if lines else []
