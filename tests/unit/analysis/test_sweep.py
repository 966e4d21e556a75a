"""Sweeps: plans, resumed runs, lost runs, and what the folder keeps."""

import csv
import dataclasses
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from relform_analysis.flight.archive import read_log
from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.summary import Json
from relform_analysis.sweep import runs as sweep
from relform_analysis.sweep.console import print_report
from relform_analysis.sweep.flight_row import fly, identity
from relform_analysis.sweep.folder import SWEEP_FILE, TABLE, SweepFolder, write_table
from relform_analysis.sweep.grid import grid_variants, parse_grid
from relform_analysis.sweep.plan import Run, load_variants, plan_runs
from relform_analysis.sweep.runs import fly_all, in_order, resume
from relform_analysis.sweep.software import ROOTS, flight_software, imported
from relform_core.errors import ConfigError, FlightError, RelformError
from relform_core.load import load_scenario
from support.logs import perfect_builder
from support.scenarios import PAPER, paper_scenario
from support.sweeps import BASE, LOOSE, short_phases, short_runs

VARIANTS = "variants: [{name: full, title: all of it, set: []}, {name: cold, title: c, set: [a.b=1]}]"


def written(folder: Path, text: str) -> Path:
    file = folder / "variants.yaml"
    file.write_text(text)
    return file


def pretended(run: Run) -> tuple[Json, FlightLog | None]:
    """In place of a flight: the seed decides the outcome."""
    row: Json = {**identity(run), "outcome": "completed", "reason": None}
    match run.seed:
        case 2:
            row |= {"outcome": "fault", "reason": "follower_1 collided with leader"}
        case 3:
            row |= {"outcome": "failed", "reason": "no C compiler found"}
        case 4:
            raise MemoryError("out of it")
    return row | {"steady_mean_m": 0.01 * run.seed}, None


@pytest.fixture
def flown(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the runs that were flown; the flights are simulated by ``pretended``."""
    names: list[str] = []

    def fly(run: Run) -> tuple[Json, FlightLog | None]:
        names.append(run.name)
        return pretended(run)

    monkeypatch.setattr(sweep, "fly", fly)
    return names


def fly_here(runs: Sequence[Run], path: Path) -> list[Json]:
    with SweepFolder(path) as folder, ThreadPoolExecutor(2) as executor:
        rows, missing = resume(runs, folder)
        rows += fly_all(missing, folder, executor)
    return in_order(rows, runs)


def test_variants_of_a_file(tmp_path: Path) -> None:
    full, cold = load_variants(written(tmp_path, VARIANTS))
    assert (full.name, full.title, full.set) == ("full", "all of it", ())
    assert cold.set == ("a.b=1",)


def test_paths_in_a_file_of_variants_are_relative_to_it(tmp_path: Path) -> None:
    text = "variants: [{name: a, title: t, set: [controller=../b.yaml, 'vehicle={mass_kg: 1}', x=../c]}]"
    (variant,) = load_variants(written(tmp_path, text))
    assert variant.set == (f"controller={tmp_path.parent / 'b.yaml'}", "vehicle={mass_kg: 1}", "x=../c")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "{file}: must hold a mapping of keys to values at its top level"),
        ("[1, 2]", "{file}: must hold a mapping of keys to values at its top level"),
        ("variants: []", "{file}: variants: must have at least 1 item(s) (got [])"),
        ("variants: {a: 1}", "{file}: variants: must be a list (got {{'a': 1}})"),
        ("variants: [", "{file}:1:12: not valid YAML: expected the node content, but found '<stream end>'"),
        (
            "variants: [{name: a, name: b}]",
            '{file}:1:22: not valid YAML: found duplicate key "name" with value "b" (original value: "a")',
        ),
        (
            "variants: [{name: 2026-11-22}]",
            "{file}: holds a value that is neither text, number, list nor mapping",
        ),
        ("variants: [{name: a, title: b}]", "{file}: variants.0.set: missing key"),
        ("variants: [{name: a, title: b, set: [], x: 1}]", "{file}: variants.0.x: unknown key"),
        ("variants: [{name: a, title: b, set: y=1}]", "{file}: variants.0.set: must be a list (got 'y=1')"),
        (
            "variants: [{name: ../a, title: b, set: []}]",
            "{file}: variants.0.name: must match pattern '^[A-Za-z0-9][A-Za-z0-9_.-]*$' (got '../a')",
        ),
        (
            "variants: [{name: a, title: b, set: []}, {name: a, title: c, set: []}]",
            "{file}: variant 'a' is named twice",
        ),
    ],
)  # fmt: skip
def test_bad_files_of_variants(tmp_path: Path, text: str, message: str) -> None:
    file = written(tmp_path, text)
    with pytest.raises(ConfigError) as error:
        load_variants(file)
    assert str(error.value) == message.format(file=file)


def test_unreadable_files_of_variants(tmp_path: Path) -> None:
    for path, problem in ((tmp_path / "none", "no such file"), (tmp_path, "cannot be read: Is a directory")):
        with pytest.raises(ConfigError, match=re.escape(f"{path}: {problem}")):
            load_variants(path)
    (tmp_path / "binary").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigError, match="binary: cannot be read: not a text file in UTF-8"):
        load_variants(tmp_path / "binary")


def test_plain_name_of_variants_is_an_installed_file() -> None:
    assert load_variants("ablation") == load_variants(PAPER.parents[1] / "sweeps/ablation.yaml")
    with pytest.raises(ConfigError, match=r"^unknown variants 'ablatoin' .*: .* or one of ablation"):
        load_variants("ablatoin")


def test_plain_name_in_a_file_of_variants_stays_one(tmp_path: Path) -> None:
    text = "variants: [{name: a, title: t, set: [controller=retuned]}]"
    (variant,) = load_variants(written(tmp_path, text))
    assert variant.set == ("controller=retuned",)


def test_the_repository_has_variants_that_can_be_flown() -> None:
    for file in sorted((PAPER.parents[1] / "sweeps").glob("*.yaml")):
        variants = load_variants(file)
        assert [run.variant for run in plan_runs(PAPER, variants, (), [1])] == [v.name for v in variants]


def test_a_plan_goes_seed_by_seed() -> None:
    runs = plan_runs(PAPER, (BASE, LOOSE), ["controller.horizon_steps=9"], [5, 6])
    assert [run.name for run in runs] == ["base-s5", "loose-s5", "base-s6", "loose-s6"]
    assert [run.seed for run in runs] == [5, 5, 6, 6]
    assert [run.scenario.config.controller.weights.formation for run in runs] == [10.0, 1.0, 10.0, 1.0]
    assert all(run.scenario.config.controller.horizon_steps == 9 for run in runs)
    assert len({run.fingerprint for run in runs}) == 4


def test_another_seed_is_the_same_as_loading_with_it() -> None:
    first = load_scenario(PAPER, ["title=seed 3, not the seed", "start.yaw_deg=20"], 41)
    again = load_scenario(PAPER, ["title=seed 3, not the seed", "start.yaw_deg=20"], 42)
    assert first.with_seed(42).effective_yaml == again.effective_yaml
    assert first.with_seed(42).seed == 42
    assert first.with_seed(42).config is first.config


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["controller.wings=2"], "variant 'odd': --set controller.wings: unknown key"),
        (["seed = 9"], "variant 'odd': --set seed: a sweep flies many; --seed is the first of them"),
        (["controller=nowhere.yaml"], r"variant 'odd': .*nowhere\.yaml: no such file"),
        (["controller.horizon_steps=0"], r"variant 'odd': --set controller.horizon_steps: must .* \(got 0\)"),
    ],
)
def test_a_variant_that_cannot_be_flown_is_one_line_before_any_flight(
    overrides: list[str], message: str
) -> None:
    odd = BASE.model_copy(update={"name": "odd", "set": tuple(overrides)})
    with pytest.raises(ConfigError, match=message) as error:
        plan_runs(PAPER, (BASE, odd), (), [1, 2])
    assert "\n" not in str(error.value)


def test_a_fingerprint_changes_with_configuration_seed_and_software() -> None:
    (run,) = short_runs(1)
    assert short_runs(1)[0].fingerprint == run.fingerprint
    others = [*short_runs(2)[1:], *short_runs(1, "start.yaw_deg=1"), dataclasses.replace(run, software="x")]
    assert run.fingerprint not in {other.fingerprint for other in others}
    assert re.fullmatch(r"[0-9a-f]{64}", flight_software())


def test_stored_runs_are_not_flown_again(tmp_path: Path, flown: list[str]) -> None:
    runs = short_runs(2, variants=(BASE, LOOSE))
    rows = fly_here(runs[:3], tmp_path)
    assert sorted(flown) == ["base-s1", "base-s2", "loose-s1"]
    flown.clear()
    again = fly_here(runs, tmp_path)
    assert flown == ["loose-s2"]
    assert again[:3] == rows
    assert [(row["variant"], row["seed"]) for row in again] == [
        ("base", 1), ("loose", 1), ("base", 2), ("loose", 2),
    ]  # fmt: skip


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: "",
        lambda text: text[: len(text) // 2],
        lambda text: "[]",
        lambda text: "{}",
        lambda text: text.replace('"row"', '"rows"'),
        lambda text: json.dumps({"fingerprint": json.loads(text)["fingerprint"], "row": {"a": []}}),
        lambda text: "\udcff\x00",
    ],
)
def test_a_damaged_result_is_flown_again(
    tmp_path: Path, flown: list[str], damage: Callable[[str], str]
) -> None:
    runs = short_runs(1)
    rows = fly_here(runs, tmp_path)
    (file,) = (tmp_path / "runs").glob("*.json")
    file.write_text(damage(file.read_text()), errors="surrogateescape")
    assert fly_here(runs, tmp_path) == rows
    assert flown == ["base-s1"] * 2
    assert fly_here(runs, tmp_path) == rows
    assert flown == ["base-s1"] * 2


def test_changed_software_flies_again(tmp_path: Path, flown: list[str]) -> None:
    fly_here(short_runs(1), tmp_path)
    changed_software = [dataclasses.replace(run, software="other") for run in short_runs(1)]
    fly_here(changed_software, tmp_path)
    assert flown == ["base-s1"] * 2
    fly_here(changed_software, tmp_path)
    assert flown == ["base-s1"] * 2


@pytest.mark.parametrize(
    ("planned", "replaced"),
    [
        (lambda: short_runs(5, variants=(LOOSE,)), ["base-s1", "base-s2", "base-s5"]),
        (lambda: short_runs(4), ["base-s5"]),
        (lambda: short_runs(5, "start.yaw_deg=30"), ["base-s1", "base-s2", "base-s5"]),
    ],
    ids=["other variants", "fewer seeds", "another configuration"],
)
def test_a_sweep_does_not_replace_another_one(
    tmp_path: Path, flown: list[str], planned: Callable[[], list[Run]], replaced: list[str]
) -> None:
    rows = fly_here(short_runs(5), tmp_path)
    SweepFolder(tmp_path).conclude("s.yaml", (), (BASE,), rows, {})
    kept = {file: file.read_bytes() for file in tmp_path.rglob("*") if file.is_file()}
    flown.clear()
    with pytest.raises(RelformError) as refusal:
        fly_here(planned(), tmp_path)
    assert str(refusal.value) == (
        f"{tmp_path}: holds {len(replaced)} flight(s) of another sweep, with other variants, seeds or "
        f"settings ({', '.join(replaced)}); name another folder with --out, or delete this one"
    )
    assert not flown
    assert {file: file.read_bytes() for file in tmp_path.rglob("*") if file.is_file()} == kept


def test_more_seeds_and_variants_add_to_a_sweep(tmp_path: Path, flown: list[str]) -> None:
    fly_here(short_runs(1), tmp_path)
    assert len(fly_here(short_runs(2, variants=(BASE, LOOSE)), tmp_path)) == 4
    assert sorted(flown) == ["base-s1", "base-s2", "loose-s1", "loose-s2"]


def test_a_grid_grows(tmp_path: Path, flown: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    torque, steps = "controller.weights.torque_per_n2_m2", "controller.horizon_steps"

    def fly_grid(*options: str) -> Json:
        variants = grid_variants(parse_grid(options))
        rows = fly_here(plan_runs(PAPER, variants, (short_phases(0.25),), [1, 2]), tmp_path)
        return SweepFolder(tmp_path).conclude("s.yaml", (), variants, rows, {})

    fly_grid(f"{torque}=4,40", f"{steps}=12")
    flown.clear()
    report = fly_grid(f"{torque}=4,40", f"{steps}=12,15")
    assert sorted(flown) == [
        "torque-40_horizon_steps-15-s1", "torque-40_horizon_steps-15-s2",
        "torque-4_horizon_steps-15-s1", "torque-4_horizon_steps-15-s2",
    ]  # fmt: skip
    assert [variant["parameters"] for variant in report["variants"]] == [
        {torque: 4, steps: 12}, {torque: 4, steps: 15}, {torque: 40, steps: 12}, {torque: 40, steps: 15},
    ]  # fmt: skip
    print_report(report, Console(width=120))
    printed = capsys.readouterr().out
    assert "formation (m), mean: torque down, horizon_steps across" in printed
    rows = [line.split() for line in printed.splitlines()]
    assert ["40", "0.01", "(1/2", "completed)", "0.01", "(1/2", "completed)"] in rows  # seed 2 crashes


def test_all_code_that_flies_a_run_is_in_its_fingerprint(tmp_path: Path) -> None:
    program = (
        "import dataclasses, sys\n"
        "from pathlib import Path\n"
        "from relform_analysis.flight.archive import write_log\n"
        "from relform_analysis.sweep.flight_row import fly\n"
        "from support.sweeps import short_runs\n"
        "run = dataclasses.replace(short_runs(1)[0], keeps_log=True)\n"
        "row, log = fly(run)\n"
        f"write_log(Path({str(tmp_path / 'log.npz')!r}), log)\n"
        "print(row['outcome'], *(name for name in sys.modules if name.startswith('relform_')))\n"
    )
    path = f"{Path(__file__).parents[2]}:{os.environ.get('PYTHONPATH', '')}"
    environment = os.environ | {"PYTHONPATH": path}
    flown = subprocess.run(
        [sys.executable, "-c", program],
        env=environment,
        check=True,
        capture_output=True,
        text=True,
    )
    outcome, *loaded = flown.stdout.split()
    assert outcome == "completed"
    modules, libraries = imported(ROOTS)
    assert set(loaded) - {"relform_workspace"} <= modules.keys()  # which only finds the packages
    assert {"casadi", "numpy", "scipy", "pydantic"} <= libraries.keys()
    assert not {"matplotlib", "jinja2"} & libraries.keys()


def test_a_crash_is_an_outcome_and_a_failure_is_tried_again(tmp_path: Path, flown: list[str]) -> None:
    runs = short_runs(4)
    rows = fly_here(runs, tmp_path)
    assert [row["outcome"] for row in rows] == ["completed", "fault", "failed", "failed"]
    assert [row["reason"] for row in rows[1:]] == [
        "follower_1 collided with leader", "no C compiler found", "out of it",
    ]  # fmt: skip
    flown.clear()
    assert fly_here(runs, tmp_path) == rows
    assert sorted(flown) == ["base-s3", "base-s4"]


def test_table_and_statistics_hold_every_run(tmp_path: Path, flown: list[str]) -> None:
    rows = fly_here(short_runs(4), tmp_path)
    returned = SweepFolder(tmp_path).conclude("s.yaml", ("a.b=1",), (BASE, LOOSE), rows, {"relform": "0.1.0"})
    report = json.loads((tmp_path / SWEEP_FILE).read_text())
    assert report == returned
    assert report["versions"] == {"relform": "0.1.0"}
    assert report["set"] == ["a.b=1"]
    base, loose = report["variants"]
    assert (base["runs"], base["completed"], base["crashed"], base["failed"]) == (4, 1, 1, 2)
    assert [lost["seed"] for lost in base["reasons"]] == [2, 3, 4]
    assert base["metrics"]["steady_mean_m"]["mean"] == 0.01
    assert (loose["runs"], loose["metrics"]) == (0, {})
    with (tmp_path / TABLE).open(newline="") as stream:
        table = list(csv.DictReader(stream))
    assert [row["outcome"] for row in table] == ["completed", "fault", "failed", "failed"]
    assert [row["steady_mean_m"] for row in table] == ["0.01", "0.02", "0.03", ""]


def test_a_table_is_written_atomically(tmp_path: Path) -> None:
    table = tmp_path / TABLE
    table.write_text("of the sweep before")
    (tmp_path / f".{TABLE}-{os.getpid()}").mkdir()
    with pytest.raises(RelformError, match=r"runs\.csv: cannot be written: Is a directory"):
        write_table(table, [{"variant": "base", "seed": 1}])
    assert table.read_text() == "of the sweep before"


def test_runs_that_have_not_started_are_cancelled_when_the_sweep_is_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[int] = []

    def slow(run: Run) -> tuple[Json, FlightLog | None]:
        started.append(run.seed)
        time.sleep(0.05)
        return {"variant": run.variant, "seed": run.seed, "outcome": "completed", "reason": None}, None

    monkeypatch.setattr(sweep, "fly", slow)
    runs = short_runs(40)
    with SweepFolder(tmp_path) as folder, ThreadPoolExecutor(1) as executor:
        rows = fly_all(runs, folder, executor)
        next(rows)
        rows.close()
        assert len(started) < 10
        assert len(resume(runs, folder)[0]) >= 1


def test_only_one_sweep_at_a_time_in_a_folder(tmp_path: Path) -> None:
    message = re.escape(f"{tmp_path}: another sweep is running in this folder")
    with SweepFolder(tmp_path), pytest.raises(RelformError, match=message), SweepFolder(tmp_path):
        pass
    with SweepFolder(tmp_path):
        pass


def test_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(RelformError, match="file: cannot be made: Not a dir"), SweepFolder(tmp_path / "file"):
        pass


def test_a_result_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    folder, (run,) = SweepFolder(tmp_path), short_runs(1)
    (tmp_path / "runs" / f".{run.name}.json-{os.getpid()}").mkdir(parents=True)
    with pytest.raises(RelformError, match=r"base-s1\.json: cannot be written: Is a directory"):
        folder.store(run, {"variant": "base"})
    (tmp_path / TABLE).mkdir()
    with pytest.raises(RelformError, match=r"runs\.csv: cannot be written: Is a directory"):
        folder.conclude("s.yaml", (), (BASE,), [], {})


class LostMachines(Executor):
    """An executor that has lost its machines."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_exception(ConnectionError())
        return future


def test_runs_whose_machine_is_lost_are_counted(tmp_path: Path) -> None:
    with SweepFolder(tmp_path) as folder:
        rows = in_order(list(fly_all(short_runs(2), folder, LostMachines())), short_runs(2))
    assert [(row["seed"], row["outcome"], row["reason"]) for row in rows] == [
        (1, "failed", "ConnectionError"), (2, "failed", "ConnectionError"),
    ]  # fmt: skip


def test_any_error_in_a_flight_is_an_outcome(monkeypatch: pytest.MonkeyPatch) -> None:
    (run,) = short_runs(1)
    for error, reason in (
        (FlightError("no imu of leader"), "no imu of leader"),
        (ZeroDivisionError("by\nzero"), "ZeroDivisionError: by zero"),
    ):

        def fail(scenario: object, error: Exception = error) -> None:
            raise error

        monkeypatch.setattr("relform_analysis.flight.simulate.fly_in_process", fail)
        row, log = fly(run)
        assert (row["variant"], row["seed"], row["outcome"], row["reason"]) == ("base", 1, "failed", reason)
        assert log is None


def test_other_software_is_not_flown() -> None:
    (run,) = short_runs(1)
    row, _ = fly(dataclasses.replace(run, software="of another commit"))
    assert row["outcome"] == "failed"
    assert "other software than the process that planned it" in row["reason"]


def test_a_run_that_keeps_its_log(tmp_path: Path) -> None:
    kept = [dataclasses.replace(run, keeps_log=True) for run in short_runs(1)]
    folder = SweepFolder(tmp_path)
    (row,) = fly_here(short_runs(1), tmp_path)
    assert row["outcome"] == "completed"
    assert resume(kept, folder) == ([], kept)  # its row is there, but not its log
    fly_here(kept, tmp_path)
    log = folder.log(kept[0])
    assert log.phase == ("B",) * 5
    assert log.solver["kkt"].shape == (5,)
    assert np.linalg.norm(log.p_NB_N[-1, 0] - [0.0, 0.0, 2.0]) < 0.5
    assert len(resume(kept, folder)[0]) == len(resume(short_runs(1), folder)[0]) == 1


def test_a_crashed_flight_is_scored_as_far_as_it_went() -> None:
    tilt = "vehicle.tilt_max_deg=0.2"
    (run,) = plan_runs(PAPER, (BASE,), [short_phases(2.0), tilt], [1])
    row, _ = fly(run)
    assert row["outcome"] == "fault"
    assert "tilted" in row["reason"]
    assert 0 < row["steps"] < row["steps_planned"] == 40
    assert row["flown_s"] == pytest.approx(0.05 * row["steps"])


def test_archive_keeps_a_log_in_single_precision(tmp_path: Path) -> None:
    builder = perfect_builder(paper_scenario(seed=3), ["A"] * 20 + ["B"] * 7)
    builder.add_fault(1_350_000_000, "leader", "leader touched the ground")
    log = builder.build()
    run = Run("base", paper_scenario(seed=3), flight_software(), keeps_log=True)
    with SweepFolder(tmp_path) as folder:
        folder.store(run, {"variant": "base", "seed": 3, "outcome": "fault", "reason": "r"}, log)
    found = folder.log(run)
    assert (found.phase, found.faults, found.scenario) == (log.phase, log.faults, run.scenario)
    assert set(found.solver) == set(log.solver)
    for name in ("p_NB_N", "q_NB", "rotor_speeds", "p_BB_C__ref", "leader_yaw__ref"):
        np.testing.assert_allclose(getattr(found, name), getattr(log, name), rtol=1e-6, atol=1e-7)
        assert getattr(found, name).dtype == np.float64
    np.testing.assert_array_equal(found.step_ns, log.step_ns)


def test_damaged_archives_are_one_line(tmp_path: Path) -> None:
    for content in (b"", b"PK\x03\x04 cut off"):
        (tmp_path / "log.npz").write_bytes(content)
        with pytest.raises(RelformError, match=r"log\.npz: cannot be read as a flight"):
            read_log(tmp_path / "log.npz", paper_scenario())
    np.savez(tmp_path / "log.npz", phase=np.array(["A"]))
    with pytest.raises(RelformError, match=r"log\.npz: cannot be read as a flight: .*faults"):
        read_log(tmp_path / "log.npz", paper_scenario())
