"""The picture of scenarios with soft constraints."""

import pytest

from relform_analysis.plots.constraint_scenarios import SHOWN, main, picture


def test_picture_has_paths_and_bound() -> None:
    paths, over_time = picture([shown for shown in SHOWN if shown.scenario == "pillar"]).axes
    assert paths.get_title() == "pillar"
    assert len(paths.lines) == 6
    assert len(paths.patches) == 2
    bound, without, held = (line.get_ydata() for line in over_time.lines)
    assert min(without) < 0.3 < bound[0] - 0.02 < min(held)


def test_command_has_help(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "--out" in capsys.readouterr().out
