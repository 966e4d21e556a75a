"""The picture of the leader's motions."""

from pathlib import Path

import matplotlib.image
import pytest

from relform_analysis.plots.motions import SCENARIOS, main, picture
from relform_core.load import load_scenario


def test_picture_has_every_motion() -> None:
    axes = picture([load_scenario(name).config for name in SCENARIOS]).axes
    assert [each.get_title() for each in axes] == list(SCENARIOS)
    drawn = {line.get_label() for each in axes for line in each.get_lines()}
    assert drawn == {"hover", "straight", "turn", "spiral", "circle", "figure_eight", "waypoints", "path"}


def test_command_writes_the_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "motions.png"
    assert main(["--out", str(path)]) == 0
    assert capsys.readouterr().out == f"{path}\n"
    assert matplotlib.image.imread(path).std() > 0.02
