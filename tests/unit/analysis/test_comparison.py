"""Flights side by side: differences and numbers as worked by hand, and what cannot be compared in words."""

from collections.abc import Sequence

import numpy as np
import pytest

from relform_analysis.comparison.compare import compare, comparison_json
from relform_analysis.comparison.configuration import configuration_differences
from relform_analysis.comparison.flights import ComparedFlight, short_labels
from relform_analysis.comparison.results import Result
from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.simulate import fly_in_process
from relform_analysis.report.flight_source import summary_of
from relform_core.errors import FlightError
from support.logs import perfect_builder
from support.scenarios import BRIEF_HOVER, paper_scenario, team_of

PHASES = ["A"] * 20 + ["B"] * 60


def flight(label: str, log: FlightLog, versions: dict[str, str | None] | None = None) -> ComparedFlight:
    return ComparedFlight(label, f"runs/{label}", log, summary_of(log, versions=versions))


def flown(label: str, *overrides: str, seed: int = 0, phases: Sequence[str] = PHASES) -> ComparedFlight:
    """A flight without errors."""
    return flight(label, perfect_builder(paper_scenario(*overrides, seed=seed), phases).build())


@pytest.mark.parametrize(
    ("sources", "labels"),
    [
        (["runs/first/bag", "runs/second/bag"], ["first", "second"]),
        (["runs/first", "old/first.mcap"], ["first", "first.mcap"]),
        (["a/x/flight", "b/x/flight"], ["a", "b"]),
        (["a/x", "b/x", "b/y"], ["a/x", "b/x", "b/y"]),
        (["runs/sweep:full", "runs/sweep:one"], ["sweep:full", "sweep:one"]),
        (["x", "runs/x"], ["x", "runs/x"]),
    ],
)
def test_labels_are_short_and_different(sources: list[str], labels: list[str]) -> None:
    assert short_labels(sources) == labels


def test_configuration_differs_by_key() -> None:
    first = flight("one", perfect_builder(paper_scenario(), PHASES).build(), {"relform": "1.0", "x": "2"})
    changed = paper_scenario(
        "controller.horizon_steps=12",
        "phases.1.duration_s=6.5",
        "events=[{kind: wind, target: leader, start_s: 1.0, end_s: 2.0, force_n: [0.5, 0.0, 0.0]}]",
        "sensors.imu.gyro_std_deg_s=0.25",
        seed=3,
    )
    second = flight("two", perfect_builder(changed, PHASES).build(), {"relform": "1.1", "x": "2"})
    rows = {(row.section, row.key): row.values for row in configuration_differences([first, second])}
    written = first.log.scenario.written
    assert rows == {
        ("scenario", "phases.B.duration_s"): ("5", "6.5"),
        ("controller", "controller.horizon_steps"): (str(written["controller"]["horizon_steps"]), "12"),
        ("sensors", "sensors.imu.gyro_std_deg_s"): (
            f"{written['sensors']['imu']['gyro_std_deg_s']:g}",
            "0.25",
        ),
        ("events", "events.0"): (
            "not set",
            "{kind: wind, target: leader, start_s: 1, end_s: 2, force_n: [0.5, 0, 0]}",
        ),
        ("seed", "seed"): ("0", "3"),
        ("software", "relform"): ("1.0", "1.1"),
    }


def test_results_have_difference_and_ratio() -> None:
    first, second = flown("one"), flown("two", seed=1)
    first.log.p_NB_N[:, 1] += [0.0, 0.0, 0.06]  # in the pairs leader to 1 and 2 to 1, of three
    second.log.p_NB_N[:, 1] += [0.0, 0.0, 0.09]
    second.log.leader_p_NB_N__ref[40] += [0.3, 0.0, 0.4]
    rows = {row.label: row for row in compare([first, second]).results}
    mean = rows["formation error, steady, mean"]
    assert mean.values == pytest.approx((0.04, 0.06))
    assert mean.difference(1) == pytest.approx(0.02)
    assert mean.ratio(1) == pytest.approx(1.5)
    assert (mean.text(1), mean.difference_text(1), mean.ratio_text(1)) == ("0.060", "+0.020", "1.50")
    leader = rows["leader position error, maximum of all"]
    assert leader.values == pytest.approx((0.0, 0.5), abs=1e-9)
    assert leader.ratio_text(1) == "-"
    # Estimates are 10 mm too large along each axis; the truth of two pairs is 60 mm higher and lower.
    position = rows["estimated relative position, error, steady, mean"].values[0]
    lengths = [(200.0 + height**2) ** 0.5 for height in (10.0, 10.0 - 60.0, 10.0 - 60.0)]
    assert position == pytest.approx(sum(lengths) / 3.0)


def test_numbers_are_those_of_the_summary() -> None:
    first, second = flown("one"), flown("two", seed=1)
    for each, error in ((first, 0.03), (second, 0.07)):
        each.log.p_NB_N[30:, 2] += [error, -error, 0.5 * error]
        each.log.rotor_speeds[7:] += 1000.0 * error
    flights = [flight(each.label, each.log) for each in (first, second)]
    rows = {row.label: row.values for row in compare(flights).results}
    for label, key in (
        ("formation error, steady, mean", "steady_mean_m"),
        ("formation error, steady, 95 %", "steady_p95_m"),
        ("formation error, maximum of all", "peak_m"),
        ("rotor speed, standard deviation", "rotor_std_rpm"),
        ("solver time per control step, median", "step_ms_median"),
        ("KKT value, first SQP step, median", "kkt_first_median"),
    ):
        assert rows[label] == pytest.approx([each.summary[key] for each in flights]), label


def test_sign_of_a_difference_that_rounds_to_zero() -> None:
    assert Result("", "m", 3, (1.0, 0.9999)).difference_text(1) == "+0.000"


def test_flight_that_ended_early_is_compared_until_then() -> None:
    whole, short = flown("whole"), flown("short", seed=1, phases=["A"] * 20 + ["B"] * 10)
    whole.log.p_NB_N[40:, 1] += [0.0, 0.0, 9.0]  # after the end of the other
    comparison = compare([whole, short])
    assert (comparison.common.start, comparison.common.end) == pytest.approx((0.0, 1.45))
    rows = {row.label: row.values for row in comparison.results}
    assert rows["formation error, maximum of all"] == pytest.approx((0.0, 0.0), abs=1e-9)
    assert "whole after 1.45 s: not every flight lasted longer." in comparison.limits
    assert list(comparison.phases) == ["A", "B"]


def test_phases_that_begin_later_are_named() -> None:
    later = "phases.0.duration_s=1.5"
    limits = compare([flown("one"), flown("two", later, phases=["A"] * 30 + ["B"] * 60)]).limits
    assert (
        "Phases begin at other times, B at 1.00 and 1.50 s: plots are over the time of the flight." in limits
    )
    steady = flown("two", "phases.1.steady_from_s=2.0")
    assert compare([flown("one"), steady]).limits == (
        "Steady windows begin at other times of their phase, B at 2.50 and 2.00 s.",
    )


def test_phases_of_other_names_are_named() -> None:
    comparison = compare([flown("one"), flown("two", phases=["A"] * 20)])
    assert comparison.common.phases == ("A",)
    assert "Phase B of one: not begun in every flight." in comparison.limits


@pytest.fixture(scope="module")
def three() -> ComparedFlight:
    return flight("three", fly_in_process(paper_scenario(BRIEF_HOVER)))


def test_other_team_is_compared_by_common_vehicles(three: ComparedFlight) -> None:
    five = flight("five", fly_in_process(paper_scenario(*team_of(5), BRIEF_HOVER)))
    comparison = compare([five, three])
    names = comparison_json(comparison)["common"]
    assert names["vehicles"] == ["leader", "follower_1", "follower_2"]
    assert names["pairs"] == [
        ["leader", "follower_1"],
        ["leader", "follower_2"],
        ["follower_2", "follower_1"],
    ]
    assert "follower_3 and follower_4 of five: not in the team of every flight." in comparison.limits
    for number, each in enumerate((five, three)):
        (mean,) = [row for row in comparison.results if row.label == "formation error, mean of all"]
        by_pair = {(pair["observer"], pair["target"]): pair["mean_m"] for pair in each.summary["pairs"]}
        expected = np.mean([by_pair[observer, target] for observer, target in names["pairs"]])
        assert mean.values[number] == pytest.approx(expected)


def test_followers_of_other_names_are_compared_by_place(three: ComparedFlight) -> None:
    places = "{left: [-1.0, -0.5, -0.5], right: [-1.0, 0.5, -0.5]}"
    formations = f"formations_m={{initial: {places}, wide: {places}}}"
    other = flight(
        "other", fly_in_process(paper_scenario("team.followers=[left, right]", formations, BRIEF_HOVER))
    )
    comparison = compare([three, other])
    assert [len(part.pairs) for part in comparison.common.parts] == [3, 3]
    assert comparison.limits == (
        "No follower has the same name in all flights: followers are compared by their place in the team.",
    )


def test_other_control_rate_and_path_are_named(three: ComparedFlight) -> None:
    faster = flight("faster", fly_in_process(paper_scenario(BRIEF_HOVER, "controller.period_s=0.025")))
    limits = compare([three, faster]).limits
    assert limits == (
        "The control periods are 25 ms and 50 ms: numbers of one control step, such as solver times, are of "
        "different steps.",
    )
    moving = BRIEF_HOVER.replace("hover, ramp_s: 0.0", "straight, speed_m_s: 2.0, ramp_s: 0.2")
    away = flight("away", fly_in_process(paper_scenario(moving)))
    assert compare([three, away]).limits == (
        "Start or phases differ: paths and altitudes are of other tasks, only errors can be compared.",
    )


def test_flight_without_control_step_is_one_line() -> None:
    with pytest.raises(FlightError, match=r"^runs/two: not compared: the flight has no control step$"):
        compare(
            [
                flown("one"),
                ComparedFlight("two", "runs/two", perfect_builder(paper_scenario(), []).build(), {}),
            ]
        )


def test_equal_flights() -> None:
    comparison = compare([flown("one"), flown("two")])
    assert comparison.equal
    assert comparison.differences == ()
    assert comparison.limits == ()
    other = flown("three")
    other.log.rotor_speeds[3, 1, 2] += 1e-9
    assert not compare([flown("one"), other]).equal


def test_json_has_what_the_tables_have() -> None:
    first, second = flown("one"), flown("two", seed=1)
    second.log.p_NB_N[:, 1] += [0.0, 0.0, 0.09]
    content = comparison_json(compare([first, second]))
    assert [each["label"] for each in content["flights"]] == ["one", "two"]
    assert content["configuration"] == [{"section": "seed", "key": "seed", "values": ["0", "1"]}]
    assert content["common"]["vehicles"] == ["leader", "follower_1", "follower_2"]
    assert content["common"]["pairs"][-1] == ["follower_2", "follower_1"]
    (mean,) = [row for row in content["results"] if row["label"] == "formation error, steady, mean"]
    assert mean["values"] == pytest.approx([0.0, 0.06], abs=1e-9)
    assert mean["differences"] == pytest.approx([0.0, 0.06], abs=1e-9)
    assert mean["ratios"] == [None, None]
