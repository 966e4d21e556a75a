"""The picture of a flight: drawn for every flight, however short, in time, and with what belongs into it."""

import os
import re
import subprocess
import sys
from pathlib import Path
from struct import unpack

import numpy as np
import pytest
from matplotlib.image import imread

from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.plots.flight_picture import HEIGHT_PX, WIDTH_PX, draw_flight
from relform_core.errors import FlightError
from support.logs import odometry, perfect_builder
from support.scenarios import paper_scenario

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
    for left, right in ((0.03, 0.5), (0.5, 0.97)):
        for top, bottom in ((0.58, 0.75), (0.78, 0.95)):
            assert inked(path, left, top, right, bottom) > 0.01


def test_what_was_not_recorded_is_left_blank(tmp_path: Path) -> None:
    log = perfect_builder(paper_scenario(), ["A"] * 30).build()
    log.rotor_speeds[:] = np.nan
    for values in log.solver.values():
        values[:] = np.nan
    draw_flight(log, flight_metrics(log), tmp_path / "flight.png")
    assert size_of(tmp_path / "flight.png") == (WIDTH_PX, HEIGHT_PX)


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
