"""The report command on unusable input: one line, and exit code 2."""

from pathlib import Path

import pytest

from relform_analysis.report.command import main


def error_of(capsys: pytest.CaptureFixture[str], *arguments: Path | str) -> str:
    assert main([str(argument) for argument in arguments]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.count("\n") == 1
    return output.err.removeprefix("error: ").rstrip()


def test_missing_path(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "nowhere"
    assert error_of(capsys, path) == f"{path}: no such file or folder"


def test_empty_folder_is_neither_flight_nor_sweep(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        error_of(capsys, tmp_path)
        == f"{tmp_path}: not a bag: the folder has no .mcap file, and no sweep: there is no sweep.json in it"
    )
    assert not list(tmp_path.iterdir())


def test_sweep_that_was_interrupted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "runs").mkdir()
    assert error_of(capsys, tmp_path).endswith(
        "; run the command of the sweep again, it continues and writes one"
    )


def test_empty_sweep(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "sweep.json").touch()
    (tmp_path / "runs.csv").touch()
    assert error_of(capsys, tmp_path).startswith(
        f"{tmp_path / 'sweep.json'}: cannot be read: Expecting value"
    )


DATA = Path(__file__).parents[2] / "data"


def test_compared_with_nothing_or_itself(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flight, other = DATA / "short_flight", tmp_path / "other"
    assert error_of(capsys, flight, other) == f"{other}: no such file or folder"
    bag = flight / "bag_0.mcap"
    assert error_of(capsys, flight, bag) == f"{flight} and {bag} are the same flight; name two different ones"


def test_json_is_for_comparisons(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main([str(DATA / "short_flight"), "--json", str(tmp_path / "x.json")])
    assert capsys.readouterr().err == (
        "error: --json is for a comparison of flights; the numbers of one are in its summary.json; see "
        "report --help\n"
    )
