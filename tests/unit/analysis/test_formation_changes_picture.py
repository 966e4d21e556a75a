"""The picture of followers that change places."""

from pathlib import Path

import matplotlib.image
import pytest

from relform_analysis.plots.formation_changes import CHANGES, Change, main, way


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: change.title)
def test_the_followers_have_to_fly_around_each_other(change: Change) -> None:
    assert way(change.scenario()).detours is not None


def test_command_writes_the_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "changes.png"
    assert main(["--out", str(path)]) == 0
    assert capsys.readouterr().out == f"{path}\n"
    assert matplotlib.image.imread(path).std() > 0.02
