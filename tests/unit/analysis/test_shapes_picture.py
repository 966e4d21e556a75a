"""The picture of shapes and sensing graphs."""

from pathlib import Path

import matplotlib.image
import pytest

from relform_analysis.plots.shapes import main, picture


def test_picture_has_every_shape_and_graph() -> None:
    titles = [axes.get_title() for axes in picture(4).axes]
    assert titles == [
        *("kind: line", "kind: column", "kind: v", "kind: circle", "kind: grid", "kind: sphere"),
        *("sensing: complete", "sensing: star", "sensing: ring"),
        *("sensing: nearest, count 2", "sensing: nearest, count 3"),
    ]


def test_command_writes_the_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "shapes.png"
    assert main(["--out", str(path)]) == 0
    assert capsys.readouterr().out == f"{path}\n"
    assert matplotlib.image.imread(path).std() > 0.02
