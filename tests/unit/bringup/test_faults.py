"""The fault campaign without flights: what is drawn, and what is said of a flight that went wrong."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from relform_bringup.faults import checks
from relform_bringup.faults.command import main
from relform_bringup.faults.evidence import Ended, Evidence, Flown, VehicleFlown
from relform_bringup.faults.kinds import KINDS, problems
from relform_bringup.faults.plan import (
    CLOCK,
    CONTROLLER,
    NODES,
    RECORDER,
    VEHICLES,
    Action,
    Case,
    Draw,
    Fault,
)
from relform_bringup.faults.results import Result, passed_before, store, summary
from relform_core.errors import ConfigError
from relform_core.load import load_scenario

PAGE = Path(__file__).parents[3] / "docs/reliability.md"
KIND = KINDS["stop-controller"]
PLAN = KIND.draw(Draw(Case(KIND.name, 5)))
N_STEPS = round(PLAN.duration / 0.05)


def vehicle(gap_s: float = 0.0, height_m: float = 1.7) -> VehicleFlown:
    """One that got a command in every step, but none for a while after 1 s, and stays at a height."""
    times = 0.05 * np.arange(N_STEPS + 1)
    commanded = times[:-1][(times[:-1] < 1.0) | (times[:-1] > 1.0 + gap_s)]
    still = np.zeros(len(times))
    return VehicleFlown(
        times, still + height_m, still, still, commanded, np.zeros(len(commanded), dtype=np.int64), ()
    )


def flown(
    error_m: float = 0.02,
    gap_s: float = 0.0,
    first: int = 0,
    height_m: float = 1.7,
    faults: tuple[str, ...] = (),
    admissions: tuple[tuple[float, str, bool], ...] = (),
) -> Flown:
    steps = np.arange(first, N_STEPS + 1)
    return Flown(
        steps=steps,
        vehicles={name: vehicle(gap_s, height_m) for name in VEHICLES},
        vehicle_faults=faults,
        admissions=admissions,
        team_modes=(),
        formation_errors=np.full(N_STEPS, error_m),
        error_times=0.05 * np.arange(N_STEPS),
        reports={},
    )


def evidence(**changes: object) -> Evidence:
    good = Evidence(tuple(Ended(name, 0, "") for name in NODES), wall=8.0, flown=flown())
    return dataclasses.replace(good, **changes)  # type: ignore[arg-type]


def ended(name: str, code: int | None, output: str, was_killed: bool = False) -> tuple[Ended, ...]:
    return tuple(
        Ended(node, code, output, was_killed) if node == name else Ended(node, 0, "") for node in NODES
    )


def test_a_case_is_read_from_its_text() -> None:
    case = Case.parse("kill-clock:4711")
    assert (case.kind, case.seed, str(case)) == ("kill-clock", 4711, "kill-clock:4711")


@pytest.mark.parametrize("text", ["kill-clock", "kill-clock:", ":7", "kill-clock:-7", "kill-clock:x"])
def test_another_text_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match=r"case must be KIND:SEED, as in kill-controller:4711 \(got "):
        Case.parse(text)


@pytest.mark.parametrize("kind", KINDS.values(), ids=lambda kind: kind.name)
def test_draws_follow_from_the_seed_alone(kind) -> None:  # type: ignore[no-untyped-def]
    plans = [kind.draw(Draw(Case(kind.name, seed))) for seed in range(40)]
    assert plans == [kind.draw(Draw(Case(kind.name, seed))) for seed in range(40)]
    assert len({str(plan) for plan in plans}) == 40
    for plan in plans:
        times = [fault.time for fault in plan.faults]
        assert times == sorted(times)
        assert all(0.0 < time < plan.duration for time in times)
        assert set(plan.order) in ({"fly"}, set(NODES))
        assert plan.late.keys() <= set(NODES)
        load_scenario("paper", plan.overrides, 0)


@pytest.mark.parametrize("kind", KINDS.values(), ids=lambda kind: kind.name)
def test_what_is_stopped_is_continued(kind) -> None:  # type: ignore[no-untyped-def]
    for seed in range(20):
        plan = kind.draw(Draw(Case(kind.name, seed)))
        assert len(plan.times(Action.STOP)) == len(plan.times(Action.CONTINUE))
        assert len(plan.times(Action.PIN)) == len(plan.times(Action.UNPIN))


def test_a_good_flight_passes() -> None:
    assert problems(KIND, PLAN, evidence()) == ()
    waits = ended(CLOCK, 0, "/sim/clock: still waiting for /recorder\n")
    assert problems(KIND, PLAN, evidence(ends=waits)) == ()


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"ends": ended(RECORDER, None, "")}, "recorder hangs"),
        ({"ends": ended(CONTROLLER, 1, "x: reason\n")}, "controller exited with 1 instead of 0: x: reason"),
        ({"ends": ended("leader", 0, "odd\n")}, "leader prints 1 lines: odd"),
        ({"orphans": ("python clock",)}, "left running: python clock"),
        ({"bag_problem": "no bag"}, "no bag"),
        ({"flown": flown(error_m=0.3)}, "formation error 0.300 m at the end, allowed are 0.25 m"),
        ({"flown": flown(first=2)}, f"2 of {N_STEPS + 1} steps are missing, the first is 0"),
        ({"flown": flown(faults=("leader: tilt",))}, "fault of a vehicle: leader: tilt"),
        ({"flown": flown(gap_s=PLAN.disturbed + 0.7)}, "leader had no commands for "),
    ],
)
def test_what_went_wrong_is_named(changes: dict[str, object], expected: str) -> None:
    found = problems(KIND, PLAN, evidence(**changes))
    assert found
    assert found[0].startswith(expected)


def test_a_traceback_is_a_problem_of_its_own() -> None:
    found = problems(KIND, PLAN, evidence(ends=ended(CLOCK, 1, "Traceback (most recent call last):\n x\n")))
    assert found[0] == "clock prints a traceback"


def test_gaps_that_the_fault_causes_are_allowed() -> None:
    assert problems(KIND, PLAN, evidence(flown=flown(gap_s=PLAN.disturbed + 0.4))) == ()


def test_nodes_must_name_the_clock_that_was_killed() -> None:
    kind = KINDS["kill-clock"]
    plan = kind.draw(Draw(Case(kind.name, 3)))
    gone = "/x: /sim/clock has gone in step 7 (0.35 s): the flight is over\n"
    ends = tuple(Ended(name, 1, gone) for name in NODES if name != CLOCK)
    killed = (*ends, Ended(CLOCK, -9, "", was_killed=True))
    assert problems(kind, plan, evidence(ends=killed)) == ()
    silent = (*ends[1:], Ended(ends[0].name, 1, "x: no idea\n"), killed[-1])
    (found,) = problems(kind, plan, evidence(ends=silent))
    assert found.endswith("does not say '/sim/clock has gone in step': x: no idea")


def test_vehicles_that_have_not_landed_are_named() -> None:
    assert list(checks.landed(evidence(flown=flown(height_m=0.1)))) == []
    (first, *_) = checks.landed(evidence(flown=flown(height_m=0.4)))
    assert first == "leader ends at 0.40 m, 0.00 m/s, tilted by 0.00 rad"


def test_time_to_take_over_counts_from_admission_and_from_start() -> None:
    killed, started = Fault(1.0, Action.KILL, CONTROLLER), Fault(1.5, Action.START, CONTROLLER)
    plan = dataclasses.replace(PLAN, faults=(killed, started))
    team = flown(gap_s=3.0, admissions=((3.6, "/formation/controller", True),))
    seen = evidence(flown=team, done=(1.05, 1.5))
    assert checks.takeover(plan, seen) == pytest.approx((0.45, 2.55))
    assert list(checks.taken_over(plan, seen)) == []
    assert not checks.came_late(seen)
    late = flown(admissions=((6.1, "/formation/controller", True),))
    assert checks.came_late(evidence(flown=late, done=(1.05, 1.5)))
    refused = flown(admissions=((3.6, "/formation/controller", False),))
    assert list(checks.taken_over(plan, evidence(flown=refused, done=(1.05, 1.5)))) == [
        "no controller took the team over"
    ]
    slow = flown(gap_s=4.2, admissions=((2.0, "/formation/controller", True),))
    (found,) = checks.taken_over(plan, evidence(flown=slow, done=(1.05, 1.5)))
    assert found == "it commands the team 3.25 s after its admission, allowed are 2.0 s"


def test_a_flight_that_ends_early_is_named() -> None:
    assert list(checks.reaches_end(PLAN, evidence(ticked=PLAN.duration))) == []
    assert list(checks.reaches_end(PLAN, evidence(ticked=2.0))) == [
        f"the clock ended at 2.00 s, not at {PLAN.duration:.2f} s"
    ]


def test_a_process_that_came_after_the_flight_must_end_when_it_is_interrupted() -> None:
    late = Ended(f"{CONTROLLER}_1", 130, "x: still waiting for /sim/clock\n", was_dismissed=True)
    seen = evidence(ends=(*evidence().ends, late))
    assert checks.came_late(seen)
    assert list(checks.exits(seen, {late.name: (1, "refused")})) == []


def test_results_are_kept_for_the_same_sources(tmp_path: Path) -> None:
    passed, failed = Result("kill-clock", 3, (), 9.5, (0.05, 1.5)), Result("kill-fly", 4, ("hangs",), 80.0)
    for result in (passed, failed):
        store(tmp_path, result, "abc")
    assert passed_before(tmp_path, passed.case, "abc") == passed
    assert passed_before(tmp_path, passed.case, "abd") is None
    assert passed_before(tmp_path, passed.case, None) is None
    assert passed_before(tmp_path, failed.case, "abc") is None
    assert passed_before(tmp_path, Case("kill-fly", 5), "abc") is None


def test_summary_counts_by_kind() -> None:
    times = [(0.1, 0.5), (0.2, 0.7), (0.3, 1.6)]
    results = [Result("kill-fly", 9, ("hangs",)), *(Result("x", i, (), 1.0, t) for i, t in enumerate(times))]
    found = summary(results, 61.0, {})
    assert (found["cases"], found["passed"]) == (4, 3)
    assert found["failed"] == [{"case": "kill-fly:9", "problems": ["hangs"]}]
    assert found["kinds"]["kill-fly"] == {
        "cases": 1,
        "passed": 0,
        "from_admission_s": None,
        "from_start_s": None,
    }
    assert found["kinds"]["x"]["from_admission_s"] == pytest.approx([0.2, 0.29, 0.3])
    assert found["kinds"]["x"]["from_start_s"] == pytest.approx([0.7, 1.51, 1.6])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--kinds", "wind"], "unknown kind 'wind', expected one of kill-"),
        (["--case", "what:1"], "unknown kind 'what', expected one of "),
        (["--case", "kill-clock"], "case must be KIND:SEED, as in "),
    ],
)
def test_unknown_cases_are_refused(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    assert capsys.readouterr().err.startswith(f"error: {message}")


def test_the_page_has_the_table_of_kinds() -> None:
    rows = [f"| `{kind.name}` | {kind.done} | {kind.must} |" for kind in KINDS.values()]
    assert "\n".join(rows) in PAGE.read_text(encoding="utf-8")
