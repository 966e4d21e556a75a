"""The report of a flight: numbers of the metrics, data of the log, and no link to another file."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_analysis.flight.metrics import flight_metrics, steady_steps
from relform_analysis.flight.summary import Ending, Outcome
from relform_analysis.flight.tracking_errors import formation_errors, leader_errors, scored_pairs
from relform_analysis.report.flight_page import flight_page, write_flight_report
from relform_analysis.report.flight_source import ending_from_log, summary_of
from relform_analysis.report.packing import pack, pack_coarsely
from relform_core.errors import FlightError, RelformError
from relform_core.names import SolverState
from relform_core.telemetry import Event, ParametersSet, PerStep
from support.logs import PERIOD_NS, decision, perfect_builder
from support.pages import Page, unpack
from support.scenarios import paper_scenario

COMPLETED = Ending(Outcome.COMPLETED, reason=None, wall_time=5.0, flown=27.0)
PHASES = ["A"] * 20 + ["B"] * 70
ERRORS = {"follower_1": (0.03, 0.04, 0.0), "follower_2": (0.0, 0.0, 0.12), "leader": (0.0, 0.2, 0.0)}
"""Position error of each vehicle in the second half of the flight [m]."""


def flight(*overrides: str) -> FlightLog:
    log = perfect_builder(paper_scenario(*overrides, seed=7), PHASES).build()
    half = len(PHASES) // 2
    for vehicle, name in enumerate(log.vehicles):
        log.p_NB_N[half:, vehicle] += ERRORS[name]
    log.solver["kkt"][3] = np.nan
    log.rotor_speeds[:, 1, 2] = np.linspace(300.0, 500.0, len(PHASES))
    return log


@pytest.fixture(scope="module")
def log() -> FlightLog:
    return flight()


@pytest.fixture(scope="module")
def page(log: FlightLog) -> Page:
    return Page(flight_page(log, summary_of(log, COMPLETED, {"relform": "0.1.0", "git_commit": None})))


@pytest.mark.parametrize("shape", [(0,), (5,), (4, 3), (2, 3, 4)])
def test_packed_arrays_unpack_to_single_precision(shape: tuple[int, ...]) -> None:
    values = np.random.default_rng(1).normal(size=shape) * 1e3
    values.ravel()[:1] = np.nan
    packed = pack(values.T)  # not contiguous
    np.testing.assert_array_equal(unpack(packed), values.T.astype(np.float32))


def test_coarsely_packed_arrays_keep_four_digits_of_their_range() -> None:
    values = np.array([[-250.0, np.nan], [1000.0, 3.21]])
    packed = pack_coarsely(values)
    assert len(packed["int16"]) == 12
    np.testing.assert_allclose(unpack(packed), values, rtol=0.0, atol=1250.0 / 65534.0 / 1.99)
    for same in ([], [np.nan], [7.5, 7.5]):
        np.testing.assert_array_equal(unpack(pack_coarsely(same)), np.array(same, dtype=np.float32))


def test_data_is_the_flight(log: FlightLog, page: Page) -> None:
    data = page.data
    assert data["vehicles"] == list(log.vehicles)
    for key, values in {
        "tick": log.tick_ns / 1e9,
        "position": log.p_NB_N,
        "step": log.step_ns / 1e9,
        "reference": log.leader_p_NB_N__ref,
    }.items():
        np.testing.assert_array_equal(unpack(data[key]), values.astype(np.float32), err_msg=key)
    for key, values in {
        "attitude": log.q_NB,
        "formation": log.p_BB_C__ref[:, 0],
        "error": formation_errors(log, scored_pairs(log.scenario.config.team)),
    }.items():
        coarse = 1e-5 * (np.nanmax(values) - np.nanmin(values))
        np.testing.assert_allclose(unpack(data[key]), values, rtol=1e-6, atol=coarse, err_msg=key)
    named = [
        (data["vehicles"][observer], data["vehicles"][target])
        for observer, target in (pair["vehicles"] for pair in data["pairs"])
    ]
    assert named == list(scored_pairs(log.scenario.config.team))


def test_phases_and_their_steady_windows(log: FlightLog, page: Page) -> None:
    first, second = page.data["phases"]
    assert (first["name"], first["start"], first["steady"], first["end"]) == ("A", 0.0, 0.0, 1.0)
    assert (second["name"], second["title"]) == ("B", "straight line")
    assert (second["start"], second["steady"], second["end"]) == pytest.approx((1.0, 3.5, 4.5))
    time = log.step_ns / 1e9
    in_windows = (time < 1.0) | (time > 3.5 - 1e-9)
    np.testing.assert_array_equal(in_windows, steady_steps(log))


def test_plots_hold_the_errors_speeds_and_solver(log: FlightLog, page: Page) -> None:
    panels = {panel["title"]: panel for section in page.data["sections"] for panel in section["panels"]}
    position_error, yaw_error = leader_errors(log)
    rpm = log.rotor_speeds * 30.0 / np.pi
    for title, line, values in (
        ("Formation error", 2, formation_errors(log, [("follower_2", "follower_1")])[:, 0]),
        ("Leader position error", 0, position_error),
        ("Leader yaw error", 0, np.degrees(yaw_error)),
        ("Rotor speeds, follower_1", 2, rpm[:, 1, 2]),
        ("Solver: KKT value", 1, log.solver["kkt"]),
        ("Solver: time per control step", 0, np.full(len(PHASES), 3.0)),
        ("Solver: SQP steps per control step", 0, np.full(len(PHASES), 2.0)),
    ):
        drawn = unpack(panels[title]["lines"][line]["values"])
        width = np.nanmax(values) - np.nanmin(values)
        np.testing.assert_allclose(drawn, values, rtol=1e-6, atol=1e-5 * width, err_msg=title)
    assert panels["Formation error"]["guides"][0]["values"] == [0.068]
    assert panels["Rotor speeds, leader"]["guides"][0]["values"] == pytest.approx([1200.0, 6000.0])
    assert panels["Solver: time per control step"]["guides"][0]["values"] == [50.0]


def test_tables_are_the_metrics(log: FlightLog, page: Page) -> None:
    metrics = flight_metrics(log)
    compared = {label: value for label, value, _ in page.tables["compared"][1:]}
    assert compared["formation error, steady, mean"] == f"{metrics.score.formation.steady.mean:.3f} m"
    assert compared["formation error, maximum of all"] == f"{metrics.score.formation.all.max:.3f} m"
    assert compared["smallest separation"] == f"{metrics.separation_min:.2f} m"
    assert compared["real-time factor"] == "5.4"

    head, *rows = page.tables["phases"]
    assert head == ["", "", "A", "B", "C", "D", "E", "all", "steady"]
    subjects = [*metrics.score.pairs, "leader position", "leader yaw"]
    for index, subject in enumerate(subjects[:4]):
        for offset, statistic in enumerate(("mean", "p95", "max")):
            row = rows[3 * index + offset][-8:]  # the subject's name spans its three rows
            scores = [phase.score for phase in metrics.phases] + [metrics.score]
            errors = [
                score.leader_position if isinstance(subject, str) else score.pairs[subject]
                for score in scores
            ]
            values = [getattr(error.all, statistic) for error in errors]
            values.append(getattr(errors[-1].steady, statistic))
            assert row[0] == statistic
            assert row[1:] == ["-" if np.isnan(value) else f"{value:.3f}" for value in values]


def test_numbers_that_break_the_papers_bounds_are_marked(page: Page) -> None:
    missed = re.findall(r'<td class="missed">([^<]*)</td>', page.html)
    (steady, *_) = (value for label, value, _ in page.tables["compared"] if label.endswith("steady, mean"))
    assert float(steady.split()[0]) > 0.068  # the flight of this test is a bad one
    assert missed == [steady]


def test_report_holds_configuration_and_software(log: FlightLog, page: Page) -> None:
    assert "mass_kg: 0.716" in page.text
    assert page.tables["versions"] == [["relform", "0.1.0"], ["git_commit", "not installed"]]
    assert "3 vehicles · scenario paper · seed 7 · 27.0 s flown" in page.text


def test_report_refers_to_no_other_file(page: Page) -> None:
    assert all(reference.startswith("data:") for reference in page.references)
    style = page.html.partition("<style>")[2].partition("</style>")[0]
    assert "url(" not in style
    assert "@import" not in style
    assert not re.findall(r"\b(fetch|XMLHttpRequest|WebSocket|import)\s*\(", page.scripts[-1])
    assert "default-src 'none'" in page.html
    assert len(page.html) < 500_000


def test_report_carries_the_licence_of_what_draws_its_plots(page: Page) -> None:
    assert "Copyright (c) 2022 Leon Sorokin" in page.scripts[-1]


def test_texts_of_a_scenario_are_escaped() -> None:
    title = "</script><script>alert(1)</script> & <b>"
    log = flight(f'title="{title}"')
    page = Page(flight_page(log, summary_of(log, COMPLETED, {"<i>": "&amp;"})))
    assert "alert" not in "".join(page.scripts)
    assert title in page.text
    assert page.tables["versions"] == [["<i>", "&amp;"]]


def test_fault_is_named_at_the_top() -> None:
    builder = perfect_builder(paper_scenario(), ["A"] * 5)
    builder.add_fault(200_000_000, "follower_1", "follower_1 collided with leader")
    log = builder.build()
    ending = ending_from_log(log)
    assert (ending.outcome, ending.reason) == (Outcome.FAULT, "follower_1 collided with leader")
    page = Page(flight_page(log, summary_of(log, ending)))
    ending_words = "Crashed at 0.25 s of 27 s, in phase A. follower_1 collided"
    assert page.text.count(ending_words) == 1
    assert page.text.index("Crashed at") < page.text.index("Beside the paper")
    assert "steady, mean" not in page.text
    assert "Formation error, steady" not in page.text
    assert page.tables["phases"][0][-1] == "all"


def test_report_names_the_early_end_of_a_recording() -> None:
    log = perfect_builder(paper_scenario(), PHASES).build()
    ending = ending_from_log(log)
    assert ending.outcome is Outcome.INTERRUPTED
    page = Page(flight_page(log, summary_of(log, ending)))
    assert "The recording ends after 90 of 540 control steps." in page.text
    assert "Not recorded" not in page.text


def test_events_and_changes_are_listed_with_their_times() -> None:
    gust = "{kind: wind, start_s: 1.5, end_s: 2.5, target: follower_1, force_n: [0.0, 3.5, 0.0]}"
    weak = "{kind: thrust_scale, start_s: 0.5, end_s: 4.0, target: leader, scale: 0.8}"
    scenario = paper_scenario(f"events=[{gust}, {weak}]", "links.down.loss_probability=0.3")
    builder = perfect_builder(scenario, PHASES)
    page = Page(flight_page(log := builder.build(), summary_of(log)))
    assert [[text.strip() for text in row] for row in page.tables["happenings"]] == [
        ["0.00 to 4.50 s", "all links, down", "loss_probability = 0.3"],
        ["0.50 to 4.00 s", "leader", "thrust scale, scale = 0.8"],
        ["1.50 to 2.50 s", "follower_1", "wind, force_n = [0.0, 3.5, 0.0]"],
    ]
    assert page.data["happenings"][2] == {"start": 1.5, "end": 2.5, "kind": "disturbance"}
    assert "saved as a file, it is a scenario that flies the same flight" in page.text

    change = ParametersSet({"weights.formation_per_m2": 12.0})
    builder.add_event(PerStep(20, 1_000_000_000, Event("/formation/controller", change)))
    page = Page(flight_page(log := builder.build(), summary_of(log)))
    assert [text.strip() for text in page.tables["happenings"][2]] == [
        "1.00 s", "/formation/controller", "set weights.formation_per_m2 = 12",
    ]  # fmt: skip
    assert (
        "changed in flight, see what happened: saved as a file, it does not fly the same flight" in page.text
    )
    assert "that flies the same flight" not in page.text


def test_fallbacks_are_reported() -> None:
    log = perfect_builder(paper_scenario(), PHASES).build()
    assert "Fallback" not in Page(flight_page(log, summary_of(log, COMPLETED))).text
    log.solver["status"][[3, 7, 8]] = SolverState.FALLBACK
    page = Page(flight_page(log, summary_of(log, COMPLETED)))
    assert "Fallback: in 3 of 90 control steps an SQP step failed" in page.text
    rows = {label: value for label, value, _ in page.tables["compared"][1:]}
    assert rows["control steps that fell back"] == "3"


@pytest.mark.parametrize("phases", [["A"], ["A"] * 20 + ["B"]])
def test_short_flights_and_what_was_not_recorded(phases: list[str]) -> None:
    log = perfect_builder(paper_scenario(), phases).build()
    log.rotor_speeds[:] = np.nan
    for values in log.solver.values():
        values[:] = np.nan
    page = Page(flight_page(log, summary_of(log)))
    rows = {label: value for label, value, _ in page.tables["compared"][1:]}
    assert rows["rotor speed, maximum"] == "-"
    assert "real-time factor" not in rows  # unknown, and the paper says nothing of it
    assert (
        "Not recorded: /leader/rotor_speeds, /follower_1/rotor_speeds, /follower_2/rotor_speeds" in page.text
    )
    assert "nan" not in page.text.lower().split()


def test_flight_without_control_steps_has_no_report(tmp_path: Path) -> None:
    log = FlightLogBuilder(paper_scenario()).build()
    with pytest.raises(FlightError, match=r"report\.html: no report: the flight has no control step$"):
        write_flight_report(tmp_path / "report.html", log, summary_of(log, COMPLETED))
    assert not list(tmp_path.iterdir())


def test_unwritable_file_is_one_line(tmp_path: Path, log: FlightLog) -> None:
    (tmp_path / "file").touch()
    path = tmp_path / "file/report.html"
    with pytest.raises(RelformError, match=f"^{re.escape(str(path))}: cannot be written: Not a directory$"):
        write_flight_report(path, log, summary_of(log, COMPLETED))


def test_same_flight_same_report(tmp_path: Path, log: FlightLog) -> None:
    paths = [tmp_path / name for name in ("first.html", "second.html")]
    for path in paths:
        write_flight_report(path, log, summary_of(log, COMPLETED, {"relform": "0.1.0"}))
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert sorted(tmp_path.iterdir()) == paths


def test_importing_the_command_loads_neither_matplotlib_nor_casadi() -> None:
    code = (
        "import relform_analysis.report.command, sys; "
        "sys.exit(bool({'matplotlib', 'casadi', 'scipy.stats', 'rclpy'} & set(sys.modules)))"
    )
    subprocess.run([sys.executable, "-c", code], check=True, env=os.environ)


def test_the_paper_is_named_only_where_it_was_flown() -> None:
    for changes, title in (
        ((), "The evaluation of Erunsal, Ventura and Martinoli, A to E"),
        (("controller=team",), "The evaluation of Erunsal, Ventura and Martinoli, A to E"),
        (("start.yaw_deg=10",), "paper: the paper's scenario with other start"),
        (("name=mine",), "mine: the paper's scenario with another name"),
        (("name=mine", "title=Over the field"), "Over the field"),
    ):
        log = perfect_builder(paper_scenario(*changes), PHASES).build()
        page = Page(flight_page(log, summary_of(log, COMPLETED)))
        is_paper = title.startswith("The evaluation")
        assert re.findall("<h1>(.*)</h1>", page.html) == [title.replace("'", "&#39;")]
        assert ("Beside the paper" in page.text) is is_paper
        assert ("the paper says" in page.text) is is_paper
        assert ("the paper <" in page.text) is is_paper
        (formation, *_) = page.data["sections"][0]["panels"]
        assert len(formation["guides"]) == int(is_paper)


def test_fallbacks_and_constraints_are_marked_in_time() -> None:
    builder = perfect_builder(paper_scenario(), PHASES)
    for step in (20, 21, 40):
        builder.add_decision(decision(step * PERIOD_NS, active_constraints=("tilt leader",)))
    log = builder.build()
    log.solver["status"][[3, 7, 8]] = SolverState.FALLBACK
    page = Page(flight_page(log, summary_of(log, COMPLETED)))
    assert [[text.strip() for text in row] for row in page.tables["happenings"]] == [
        ["0.15 to 0.45 s", "solver", "fallback to the plan before in 3 control steps"],
        ["1.00 to 1.10 s", "soft constraint", "tilt leader active in 2 control steps"],
        ["2.00 to 2.05 s", "soft constraint", "tilt leader active in 1 control steps"],
    ]


def test_rotors_are_a_mean_in_a_band_and_single_ones_on_demand(log: FlightLog, page: Page) -> None:
    sections = {section["title"]: section for section in page.data["sections"]}
    line = sections["Rotors and solver"]["panels"][0]["lines"][1]
    rpm = log.rotor_speeds[:, 1] * 30.0 / np.pi
    for key, values in (("values", rpm.mean(1)), ("low", rpm.min(1)), ("high", rpm.max(1))):
        np.testing.assert_allclose(unpack(line[key]), values, rtol=1e-6, atol=1e-5 * np.ptp(values))
    assert sections["Single rotors"]["closed"]
    assert len(sections["Single rotors"]["panels"]) == 3
