"""The picture of a flight: its lines, texts and parts, also of short flights."""

import os
import re
import subprocess
import sys
from pathlib import Path
from struct import unpack

import numpy as np
import pytest
from matplotlib.image import imread

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.simulate import fly_in_process
from relform_analysis.flight.tracking_errors import formation_errors, leader_errors, scored_pairs
from relform_analysis.plots.flight_picture import HEIGHT_PX, WIDTH_PX, draw_flight, flight_figure
from relform_core.errors import FlightError
from support.logs import odometry, perfect_builder
from support.scenarios import BRIEF_HOVER, paper_scenario

PERIOD_NS = 50_000_000


def size_of(png: Path) -> tuple[int, int]:
    width, height = unpack(">II", png.read_bytes()[16:24])
    return width, height


def inked(png: Path, left: float, top: float, right: float, bottom: float) -> float:
    """Share of the pixels in a part of the picture that are not white."""
    image = imread(png)[..., :3]
    rows = slice(round(top * HEIGHT_PX), round(bottom * HEIGHT_PX))
    columns = slice(round(left * WIDTH_PX), round(right * WIDTH_PX))
    return float((image[rows, columns].min(axis=-1) < 0.9).mean())


@pytest.mark.parametrize("phases", [["A"], ["A"] * 20 + ["B"] * 3])
def test_every_part_is_drawn_however_short_the_flight(tmp_path: Path, phases: list[str]) -> None:
    path = tmp_path / "flight.png"
    log = perfect_builder(paper_scenario(), phases).build()
    draw_flight(log, flight_metrics(log), path)
    assert size_of(path) == (WIDTH_PX, HEIGHT_PX)
    assert inked(path, 0.0, 0.0, 0.6, 0.08) > 0.01  # title
    assert inked(path, 0.1, 0.1, 0.8, 0.5) > 0.001  # scene
    assert inked(path, 0.03, 0.5, 0.8, 0.7) > 0.01
    for left, right in ((0.03, 0.33), (0.35, 0.66), (0.67, 0.99)):
        assert inked(path, left, 0.75, right, 0.95) > 0.01


def panels_of(log: FlightLog) -> dict[str, list[np.ndarray]]:
    """What each plot over time draws as lines, by the words of its titles."""
    panels = {}
    for axes in flight_figure(log, flight_metrics(log)).axes[1:]:  # the first is the scene
        title = "".join(axes.get_title(loc=place) for place in ("left", "center", "right"))
        panels[title] = [np.asarray(line.get_ydata()) for line in axes.lines if len(line.get_ydata()) > 2]
    return panels


def test_plots_draw_the_flight() -> None:
    log = perfect_builder(paper_scenario(), ["A"] * 20 + ["B"] * 10).build()
    log.p_NB_N[15:, 1] += [0.0, 0.3, 0.4]
    log.p_NB_N[25:, 0] += [0.1, 0.0, 0.0]
    panels = panels_of(log)
    pairs = scored_pairs(log.scenario.config.team)
    np.testing.assert_array_equal(
        panels["Formation error [m], steady state shaded"], formation_errors(log, pairs).T
    )
    position_error, yaw_error = leader_errors(log)
    np.testing.assert_array_equal(panels["Leader: position error [m]"], [position_error])
    np.testing.assert_array_equal(panels["yaw error [deg]"], [np.degrees(yaw_error)])
    speeds = panels["Rotor speed [rpm], band: all rotors"]
    np.testing.assert_allclose(speeds, log.rotor_speeds.mean(axis=-1).T * 30.0 / np.pi)
    np.testing.assert_array_equal(panels["Solver: KKT value"], [log.solver["kkt"]])
    np.testing.assert_allclose(panels["time per step [ms]"], [np.full(30, 3.0)])


def test_what_was_not_recorded_is_left_blank(tmp_path: Path) -> None:
    log = perfect_builder(paper_scenario(), ["A"] * 30).build()
    log.rotor_speeds[:] = np.nan
    for values in log.solver.values():
        values[:] = np.nan
    blank = {
        "Rotor speed [rpm], band: all rotors",
        "Solver: KKT value",
        "time per step [ms]",
    }
    panels = panels_of(log)
    assert blank <= panels.keys()
    for title, lines in panels.items():
        assert np.isnan(lines).all() == (title in blank), title
    draw_flight(log, flight_metrics(log), tmp_path / "flight.png")


def test_texts_name_the_flight_its_phases_and_key_figures() -> None:
    steps = {"A": 20, "B": 100, "C": 100, "D": 80, "E": 240}
    phases = [name for name, number in steps.items() for _ in range(number)]
    log = perfect_builder(paper_scenario(seed=7), phases).build()
    figure = flight_figure(log, flight_metrics(log))
    texts = " ".join(text.get_text() for text in figure.texts)
    assert "3 vehicles, seed 7" in texts
    assert "0.000 m mean formation error in steady state (the paper: less than 0.068 m)" in " ".join(
        texts.split()
    )
    scene, formation, *_ = figure.axes
    assert {"A", "B"} <= {text.get_text() for text in scene.texts} & {
        text.get_text() for text in formation.texts
    }
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [*log.vehicles, "leader's reference"]


def test_legends_are_off_the_curves_however_large_the_team() -> None:
    sixteen = ("team.followers=15", "formations_m={initial: {kind: grid, spacing_m: 1.2}}", "controller=team")
    for overrides in ((), sixteen):
        log = fly_in_process(paper_scenario(*overrides, BRIEF_HOVER))
        figure = flight_figure(log, flight_metrics(log))
        figure.canvas.draw()
        whole = figure.bbox
        _, formation, *others = figure.axes
        legend = formation.get_legend().get_window_extent()
        assert whole.x0 <= legend.x0
        assert legend.x1 <= whole.x1
        assert not any(legend.overlaps(axes.bbox) for axes in (formation, *others))


def test_flight_that_ended_early_says_so_and_gives_no_steady_error() -> None:
    builder = perfect_builder(paper_scenario(), ["A"] * 20 + ["B"] * 10)
    builder.add_fault(1_500_000_000, "follower_2", "touched the ground")
    log = builder.build()
    texts = [text.get_text() for text in flight_figure(log, flight_metrics(log)).texts]
    assert "ended at 1.5 s" in texts
    assert any("follower_2: touched the ground" in text for text in texts)
    assert not any("steady" in text for text in texts)


def test_flight_without_control_steps_has_no_picture(tmp_path: Path) -> None:
    builder = FlightLogBuilder(paper_scenario())
    builder.add_ground_truth("leader", odometry(0, (0.0, 0.0, 2.0), 0.0))
    with pytest.raises(FlightError, match="no control step"):
        draw_flight(log := builder.build(), flight_metrics(log), tmp_path / "flight.png")
    assert not list(tmp_path.iterdir())


def test_unwritable_file_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    path = tmp_path / "file/flight.png"
    log = perfect_builder(paper_scenario(), ["A"] * 3).build()
    with pytest.raises(FlightError, match=f"^{re.escape(str(path))}: cannot be written: Not a directory$"):
        draw_flight(log, flight_metrics(log), path)


def test_matplotlib_is_imported_only_to_draw() -> None:
    code = "import relform_analysis.plots.flight_picture, sys; sys.exit('matplotlib' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, env=os.environ)
