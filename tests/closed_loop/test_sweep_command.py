"""Sweeps from the command line, with real flights in real processes."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from relform_analysis.report.command import main as make_report
from relform_analysis.sweep.command import main
from relform_analysis.sweep.flight_row import fly
from relform_analysis.sweep.folder import SweepFolder
from relform_analysis.sweep.runs import fly_all, in_order
from relform_analysis.sweep.session import executor_for
from support.pages import Page
from support.scenarios import PAPER
from support.sweeps import BASE, LOOSE, files_of, short_phases, short_runs, without_times

SCRIPT = PAPER.parents[2] / "scripts/sweep.py"


def arguments(out: Path, runs: int, *more: str, seconds: float = 0.25) -> list[str]:
    return [
        "--scenario", str(PAPER), "--runs", str(runs), "--seed", "3", "--jobs", "2",
        "--set", short_phases(seconds), "--out", str(out), *more,
    ]  # fmt: skip


def started(*args: str) -> subprocess.Popen[str]:
    return subprocess.Popen([sys.executable, str(SCRIPT), *args], stderr=subprocess.PIPE, text=True)


def wait_for_files(sweep: subprocess.Popen[str], out: Path, number: int) -> None:
    while len(files_of(out)) < number:
        assert sweep.poll() is None, "the sweep ended too early"
        time.sleep(0.01)


@pytest.mark.parametrize(("how", "exit_code"), [(signal.SIGINT, 130), (signal.SIGKILL, -signal.SIGKILL)])
def test_an_interrupted_sweep_continues(tmp_path: Path, how: signal.Signals, exit_code: int) -> None:
    command = arguments(tmp_path, 40)
    with started(*command) as sweep:
        wait_for_files(sweep, tmp_path, 3)
        sweep.send_signal(how)
        _, told = sweep.communicate()
    assert sweep.returncode == exit_code
    if how is signal.SIGINT:
        assert "interrupted; finished runs are kept, the same command continues from there" in told
        assert "Traceback" not in told
    kept = files_of(tmp_path)
    assert 3 <= len(kept) < 40
    assert not (tmp_path / "sweep.json").exists()

    assert main(command) == 0
    assert files_of(tmp_path).items() >= kept.items()
    assert len(files_of(tmp_path)) == 40
    (variant,) = json.loads((tmp_path / "sweep.json").read_text())["variants"]
    assert (variant["runs"], variant["completed"]) == (40, 40)


def test_changed_keys_are_in_every_result(tmp_path: Path) -> None:
    variants = tmp_path / "variants.yaml"
    variants.write_text("variants: [{name: odd, title: t, set: [start.yaw_deg=20]}]")
    out, change = tmp_path / "out", "controller.horizon_steps=12"
    command = arguments(out, 1, "--variants", str(variants), "--set", change)
    assert main(command) == 0
    report = json.loads((out / "sweep.json").read_text())
    assert report["set"] == [short_phases(0.25), change]
    assert report["variants"][0]["set"] == ["start.yaw_deg=20"]
    with (out / "runs.csv").open(newline="") as table:
        (row,) = csv.DictReader(table)
    assert row["set"] == f"{short_phases(0.25)}; {change}; start.yaw_deg=20"
    assert make_report([str(out)]) == 0
    page = Page((out / "report.html").read_text()).text
    assert change in page
    assert "start.yaw_deg=20" in page


def test_a_worker_that_is_killed_costs_one_run(tmp_path: Path) -> None:
    command = arguments(tmp_path, 12, seconds=1.0)
    with started(*command) as sweep:
        wait_for_files(sweep, tmp_path, 2)
        children = Path(f"/proc/{sweep.pid}/task").glob("*/children")
        pids = [int(pid) for file in children for pid in file.read_text().split()]
        workers = [pid for pid in pids if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]
        os.kill(workers[0], signal.SIGKILL)
        assert sweep.wait() == 0
    (variant,) = json.loads((tmp_path / "sweep.json").read_text())["variants"]
    assert (variant["runs"], variant["completed"], variant["failed"]) == (12, 11, 1)
    (lost,) = variant["reasons"]
    assert lost["reason"].startswith("the process that flew it was killed by SIGKILL")

    assert main(command) == 0  # only the lost run is flown
    (variant,) = json.loads((tmp_path / "sweep.json").read_text())["variants"]
    assert (variant["runs"], variant["completed"], variant["reasons"]) == (12, 12, [])


def test_cluster_local_processes_and_this_one_fly_the_same(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    runs = short_runs(3, variants=(BASE, LOOSE))
    expected = [without_times(fly(run)[0]) for run in runs]
    with distributed.LocalCluster(n_workers=2, threads_per_worker=2, dashboard_address=None) as cluster:
        for name, jobs, scheduler in (("local", 2, None), ("dask", 1, cluster.scheduler_address)):
            with SweepFolder(tmp_path / name) as folder, executor_for(jobs, scheduler) as executor:
                rows = in_order(list(fly_all(runs, folder, executor)), runs)
                assert [without_times(row) for row in rows] == expected
                assert [folder.finished(run) for run in runs] == rows
    assert {row["outcome"] for row in expected} == {"completed"}
    assert len({row["steady_mean_m"] for row in expected}) == len(runs)


def test_missing_cluster(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("distributed")
    for address in ("nonsense", "tcp://127.0.0.1:9"):
        assert main(arguments(tmp_path, 1, "--scheduler", address)) == 2
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert line.startswith(f"error: --scheduler {address}: no cluster answers")


def test_without_dask(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(arguments(tmp_path, 1, "--scheduler", "tcp://127.0.0.1:8786")) == 2
    assert capsys.readouterr().err == "error: --scheduler needs Dask: pip install distributed\n"


def test_bad_variants_and_options(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    variants = tmp_path / "variants.yaml"
    variants.write_text("variants: [{name: odd, title: t, set: [controller.wings=2]}]")
    assert main(arguments(tmp_path / "out", 2, "--variants", str(variants))) == 2
    assert capsys.readouterr().err == (
        "error: variant 'odd': --set controller.wings: unknown key (did you mean 'weights'?)\n"
    )
    assert not (tmp_path / "out").exists()
    assert main([*arguments(tmp_path / "out", 2), "--seed", "-4"]) == 2
    assert "seed: must be a whole number of at least 0 (got -4)" in capsys.readouterr().err
    grid = ["--grid", "controller.weights.torque_per_n2_m2=-1"]
    assert main([*arguments(tmp_path / "out", 2), *grid]) == 2
    assert capsys.readouterr().err == (
        "error: --grid controller.weights.torque_per_n2_m2: must be greater than or equal to 0 (got -1)\n"
    )
    with pytest.raises(SystemExit, match="2"):
        main([*arguments(tmp_path / "out", 2, "--variants", str(variants)), *grid])
    assert "argument --grid: not allowed with argument --variants" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    for option in ("--runs", "--jobs"):
        with pytest.raises(SystemExit, match="2"):
            main([*arguments(tmp_path / "out", 2), option, "0"])
        assert f"argument {option}: must be at least 1, not 0" in capsys.readouterr().err


def test_a_sweep_without_any_flight_is_a_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("CC", "false")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert main(arguments(tmp_path / "out", 2)) == 1
    assert "default, seed 3: failed: " in (told := capsys.readouterr().out)
    assert "cannot compile the kernels" in told
    (variant,) = json.loads((tmp_path / "out/sweep.json").read_text())["variants"]
    assert (variant["runs"], variant["failed"], variant["metrics"]) == (2, 2, {})
