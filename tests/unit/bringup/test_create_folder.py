"""The folder of a run is new and complete, and ``latest`` points to the newest."""

import resource
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import pytest

from relform_bringup.create_folder import create_run_folder
from relform_core.errors import FlightError
from relform_core.load import load_scenario
from support.scenarios import paper_scenario

NOW = datetime(2026, 11, 21, 23, 42, 7)


@pytest.fixture
def in_tmp_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_name_and_effective_configuration(in_tmp_path: Path) -> None:
    scenario = paper_scenario("controller.horizon_steps=11", seed=3)
    folder = create_run_folder(scenario, None, NOW)
    assert folder.path == in_tmp_path / "runs/20261121-234207-paper-s3"
    again = load_scenario(folder.config)
    assert again.seed == 3
    assert again.config == scenario.config


def test_latest_points_to_the_newest(in_tmp_path: Path) -> None:
    for seed in (3, 4, 5):
        folder = create_run_folder(paper_scenario(seed=seed), None, NOW)
        assert (in_tmp_path / "runs/latest").resolve() == folder.path
    names = {path.name for path in (in_tmp_path / "runs").iterdir()}
    assert names == {"latest", *(f"20261121-234207-paper-s{seed}" for seed in (3, 4, 5))}


def test_two_flights_in_one_second(in_tmp_path: Path) -> None:
    names = [create_run_folder(paper_scenario(seed=3), None, NOW).path.name for _ in range(3)]
    assert names == [f"20261121-234207-paper-s3{suffix}" for suffix in ("", "-2", "-3")]


def test_chosen_folder_leaves_latest_alone(in_tmp_path: Path) -> None:
    folder = create_run_folder(paper_scenario(), Path("some/where"), NOW)
    assert folder.path == in_tmp_path / "some/where"
    assert not (in_tmp_path / "runs").exists()


def test_nothing_is_overwritten(in_tmp_path: Path) -> None:
    Path("there").mkdir()
    with pytest.raises(FlightError, match=r"^there exists already; choose another folder$"):
        create_run_folder(paper_scenario(), Path("there"), NOW)
    assert list(Path("there").iterdir()) == []


def test_failed_start_leaves_no_folder_and_latest_alone(in_tmp_path: Path) -> None:
    first = create_run_folder(paper_scenario(), None, NOW)
    too_long = replace(paper_scenario(), written={"title": "x" * 100_000})
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))  # a disk that is full
    try:
        with pytest.raises(FlightError, match=r"cannot be written: File too large$"):
            create_run_folder(too_long, None, NOW)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert {path.name for path in Path("runs").iterdir()} == {"latest", first.path.name}
    assert Path("runs/latest").resolve() == first.path


def test_no_place_to_write(in_tmp_path: Path) -> None:
    Path("file").touch()
    with pytest.raises(FlightError, match=r"^file/run: cannot be written: Not a directory$"):
        create_run_folder(paper_scenario(), Path("file/run"), NOW)
