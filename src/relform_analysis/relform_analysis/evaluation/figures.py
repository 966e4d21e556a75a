"""The paper's figures, redrawn from many flights, each with the paper's claim and the result here."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from relform_analysis.evaluation import notes
from relform_analysis.evaluation.ablation_figure import draw_ablation
from relform_analysis.evaluation.claims import of_variant
from relform_analysis.evaluation.plan import COLD, FULL
from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.summary import Json
from relform_analysis.flight.tracking_errors import follower_yaw_errors
from relform_analysis.flight.view_margins import view_margins
from relform_analysis.plots.over_time import OtherFlights, draw_over_time, save
from relform_analysis.plots.palette import Style, series_style, vehicle_style
from relform_analysis.plots.panels import Guide, Line, Panel, flight_panels
from relform_analysis.plots.paper_figures import TRAJECTORIES, draw_trajectories, pair_by_pair
from relform_analysis.plots.style import PAPER_STYLE
from relform_core.arrays import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SEEN_AT_ONCE = 10
"""Number of flights whose paths can be told apart in one scene."""


def draw_evaluation(
    folder: Path, logs: Mapping[str, Sequence[FlightLog]], variants: Sequence[Json], tuning: str
) -> list[Path]:
    """Draw the paper's figures for one tuning, and figures that the paper lacks, as PNG and PDF.

    Args:
        logs: flights by variant.
        variants: statistics of all variants.
        tuning: the variant to draw.
    Raises:
        RelformError: a file cannot be written.
    """
    import matplotlib

    cold = of_variant(variants, COLD[tuning])
    without = OtherFlights(
        f"cold start, one SQP step ({cold['completed']} of {cold['runs']} flights completed)",
        [_solver(log) for log in logs[COLD[tuning]]],
    )
    with matplotlib.rc_context(PAPER_STYLE):
        files = [
            file
            for name, figure in _figures(logs[tuning], of_variant(variants, tuning), without)
            for file in save(figure, folder, name)
        ]
        if tuning == FULL:
            files += save(draw_ablation(variants), folder, "ablation")
    return files


def _figures(
    flights: Sequence[FlightLog], variant: Json, without: OtherFlights
) -> Iterator[tuple[str, Figure]]:
    longest = max(flights, key=lambda log: len(log.phase))
    team = longest.scenario.config.team
    runs = [pair_by_pair(flight_panels(log)) for log in flights]
    formation = [run["formation_errors"] for run in runs]
    tracking = [run["tracking_errors"][:2] for run in runs]  # of the leader; the followers have a figure
    solver, followers = [_solver(log) for log in flights], [_followers(log) for log in flights]
    rotors, seed = [runs[0]["rotor_speeds"]], flights[0].scenario.seed  # a mean would hide the chatter

    yield TRAJECTORIES, draw_trajectories(flights[:SEEN_AT_ONCE], notes.trajectories(variant))
    yield "solver", draw_over_time(solver, longest, without, notes.solver(variant))
    yield "formation_errors", draw_over_time(formation, longest, note=notes.formation(variant, team))
    yield "tracking_errors", draw_over_time(tracking, longest, note=notes.tracking(variant))
    yield "rotor_speeds", draw_over_time(rotors, flights[0], note=notes.rotors(variant, seed))
    yield "followers_and_view", draw_over_time(followers, longest, note=notes.followers(variant))


def _solver(log: FlightLog) -> list[Panel]:
    """One line per plot, so that other flights can be drawn over it."""
    solver, controller = log.solver, log.scenario.config.controller
    tolerance, period_ms = controller.solver.kkt_tolerance, 1e3 * controller.period
    time_ms = 1e3 * (solver["prepare_time"] + solver["feedback_time"])

    def panel(title: str, unit: str, values: Array, *guides: Guide, log_scale: bool = True) -> Panel:
        line = Line("modified RTI", series_style(0), values)
        return Panel(title, unit, 1, [line], guides, log_scale=log_scale)

    return [
        panel("Objective", "", solver["objective"], log_scale=False),
        panel("KKT value, first SQP step", "", solver["kkt_first"]),
        panel("KKT value, last SQP step", "", solver["kkt"], Guide(f"tolerance {tolerance:g}", (tolerance,))),
        panel("Time per control step", "ms", time_ms, Guide(f"period {period_ms:g} ms", (period_ms,))),
    ]


def _followers(log: FlightLog) -> list[Panel]:
    yaws = np.degrees(follower_yaw_errors(log)).T
    least = np.degrees(np.nanmin(view_margins(log)[log.tick_of_step], axis=(1, 2)))

    def panel(title: str, style: Style, values: Array) -> Panel:
        return Panel(title, "deg", 1, [Line(title, style, values)])

    return [
        *(
            panel(f"Yaw of {log.vehicles[follower]} relative to the leader", vehicle_style(follower), yaw)
            for follower, yaw in zip(log.followers, yaws, strict=True)
        ),
        panel("Least margin of the field of view of all pairs", series_style(0), least),
    ]
