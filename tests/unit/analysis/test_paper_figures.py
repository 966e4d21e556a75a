"""Figures for papers: all drawn, each time the same; mean and deviation over flights as worked by hand."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes

from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.phases import flown_phases
from relform_analysis.flight.simulate import fly_in_process
from relform_analysis.plots import over_time as paper_plot
from relform_analysis.plots import paper_figures
from relform_analysis.plots.flight_picture import draw_flight
from relform_analysis.plots.over_time import draw_over_time, over_runs
from relform_analysis.plots.panels import flight_panels
from relform_analysis.plots.paper_figures import draw_paper_figures, pair_by_pair
from relform_core.errors import RelformError
from support.logs import perfect_builder
from support.scenarios import BRIEF_HOVER, paper_scenario, team_of


@pytest.fixture(autouse=True)
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer pixels, which are drawn faster."""
    for module in (paper_figures, paper_plot):
        monkeypatch.setattr(module, "DPI", 40)


NAMES = ("formation_errors", "tracking_errors", "rotor_speeds", "solver", "trajectories_3d")


def test_mean_and_deviation_over_the_flights_that_reached_a_step() -> None:
    mean, deviation = over_runs([np.array([1.0, 2.0, np.nan, 8.0]), np.array([3.0, 2.0, np.nan])])
    np.testing.assert_array_equal(mean, [2.0, 2.0, np.nan, 8.0])
    np.testing.assert_array_equal(deviation, [np.sqrt(2.0), 0.0, np.nan, np.nan])  # of a sample


def test_one_flight_fills_its_plots() -> None:
    log = perfect_builder(paper_scenario(), ["A"] * 20).build()
    log.p_NB_N[12, 1] += [0.0, 0.3, 0.4]
    (axes,) = draw_over_time([flight_panels(log)["formation_errors"]], log).axes
    assert axes.get_ylim() == pytest.approx((0.0, 1.05 * 0.5))


@pytest.mark.parametrize("last_tick", [20, 21])
def test_flight_that_ends_as_a_phase_begins(tmp_path: Path, last_tick: int) -> None:
    log = perfect_builder(paper_scenario(), ["A"] * 20 + ["B"]).build()
    ticks = slice(last_tick + 1)
    log = replace(log, tick_ns=log.tick_ns[ticks], p_NB_N=log.p_NB_N[ticks], q_NB=log.q_NB[ticks])
    assert [phase.tick_in_the_middle(log) for phase in flown_phases(log)] == [10, 20]
    draw_paper_figures([log], tmp_path)
    draw_flight(log, flight_metrics(log), tmp_path / "flight.png")


def test_every_figure_of_flights_of_different_length(tmp_path: Path) -> None:
    logs = [
        perfect_builder(paper_scenario(seed=seed), ["A"] * 20 + ["B"] * n).build()
        for seed, n in ((1, 9), (2, 3))
    ]
    logs[0].p_NB_N[12:, 1] += [0.1, 0.0, 0.2]
    logs[1].solver["objective"][:] = np.nan
    folder = tmp_path / "some/figures"
    files = draw_paper_figures(logs, folder)
    assert sorted(files) == sorted(folder / f"{name}.{kind}" for name in NAMES for kind in ("png", "pdf"))
    for file in files:
        assert file.read_bytes().startswith(b"\x89PNG" if file.suffix == ".png" else b"%PDF")


def test_lines_of_a_figure_are_those_of_the_panels() -> None:
    log = perfect_builder(paper_scenario(), ["A"] * 20 + ["B"] * 9).build()
    log.p_NB_N[12:, 1] += [0.1, 0.0, 0.2]
    for name, panels in flight_panels(log).items():
        for axes, panel in zip(draw_over_time([panels], log).axes, panels, strict=True):
            assert panel.title in (axes.get_title(loc="center"), axes.get_title(loc="right")), name
            told = [text.get_text() for text in axes.get_legend().get_texts()] if axes.get_legend() else []
            for number, line in enumerate(panel.lines):
                np.testing.assert_allclose(
                    drawn_lines(axes)[number], line.values, err_msg=f"{panel.title}, {line.name}"
                )
                assert len(panel.lines) == 1 or line.name in told
            assert {guide.label for guide in panel.guides} <= set(told)


def drawn_lines(axes: Axes) -> list[np.ndarray]:
    """Those over time, without levels and marks of phases."""
    return [np.asarray(line.get_ydata()) for line in axes.lines if len(line.get_ydata()) > 2]


def test_bands_and_shades_are_told_in_the_picture() -> None:
    logs = [perfect_builder(paper_scenario(seed=seed), ["A"] * 20).build() for seed in (1, 2)]
    formation, _, kkt, *_ = draw_over_time(
        [[*flight_panels(log)["formation_errors"], *flight_panels(log)["solver"]] for log in logs], logs[0]
    ).axes
    told = [[text.get_text() for text in axes.get_legend().get_texts()] for axes in (formation, kkt)]
    assert {"band: mean ± standard deviation", "steady state"} <= set(told[0])
    assert "band: mean ± standard deviation of the logarithm" not in told[0]


def test_a_large_error_is_named_where_it_leaves_the_plot() -> None:
    log = perfect_builder(paper_scenario(), ["A"] * 20 + ["B"] * 40).build()
    log.p_NB_N[:, 1] += [0.0, 0.0, 0.05]
    log.p_NB_N[25, 1] += [0.0, 0.0, 0.85]
    (axes,) = draw_over_time([flight_panels(log)["formation_errors"]], log).axes
    assert axes.get_ylim() == pytest.approx((0.0, 1.5 * 0.05))
    assert [text.get_text() for text in axes.texts if "▲" in text.get_text()] == ["▲ 0.9"]
    assert len(axes.get_yticks()[axes.get_yticks() <= axes.get_ylim()[1]]) >= 4


def test_many_pairs_share_one_plot() -> None:
    log = fly_in_process(paper_scenario(*team_of(5), BRIEF_HOVER))
    (panel,) = pair_by_pair(flight_panels(log))["formation_errors"]
    assert len(panel.lines) == 7
    figure = draw_over_time([[panel]], log)
    figure.canvas.draw()
    (axes,) = figure.axes
    assert not axes.get_legend().get_window_extent().overlaps(axes.bbox)


def test_same_flight_same_file(tmp_path: Path) -> None:
    log = perfect_builder(paper_scenario(), ["A"] * 5).build()
    first, second = (draw_paper_figures([log], tmp_path / name) for name in ("first", "second"))
    assert [file.read_bytes() for file in first] == [file.read_bytes() for file in second]


def test_unwritable_folder_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    folder = tmp_path / "file/figures"
    log = perfect_builder(paper_scenario(), ["A"] * 3).build()
    expected = f"^{re.escape(str(folder))}: figures cannot be written there: Not a directory$"
    with pytest.raises(RelformError, match=expected):
        draw_paper_figures([log], folder)
