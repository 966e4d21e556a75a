"""A plot for the page, in the format that assets/plot.js documents."""

from dataclasses import asdict

from relform_analysis.flight.summary import Json
from relform_analysis.plots.panels import Panel
from relform_analysis.report.packing import pack, pack_coarsely


def panel_data(panel: Panel) -> Json:
    """What a page needs of a plot; its lines are one set, to which the page adds the instants."""
    packed = pack if panel.log_scale else pack_coarsely
    return {
        "title": panel.title,
        "unit": panel.unit,
        "digits": panel.digits,
        "log": panel.log_scale,
        "steps": panel.steps,
        "tall": panel.tall,
        "robust": panel.is_error,
        "guides": [{"label": guide.label, "values": guide.values} for guide in panel.guides],
        "lines": [
            {
                "name": line.name,
                **asdict(line.style),
                "values": packed(line.values),
                "high": None if line.high is None else packed(line.high),
                "low": None if line.low is None else packed(line.low),
            }
            for line in panel.lines
        ],
    }
