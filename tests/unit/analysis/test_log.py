"""The log of a flight from core types, whole and with parts missing."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from relform_analysis.flight.archive import read_log, write_log
from relform_analysis.flight.log import LogEntry
from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_analysis.plots.constraint_panels import constraint_panels
from relform_core.names import EstimatorMode
from relform_core.telemetry import (
    EstimatorReport,
    Event,
    FaultReported,
    FormationSet,
    ParametersSet,
    PerStep,
    StepDecided,
)
from support.logs import FORMATION, decision, odometry, perfect_builder
from support.scenarios import paper_scenario

PERIOD_NS = 50_000_000


def test_shapes_and_axes() -> None:
    log = perfect_builder(paper_scenario(), ["A", "A", "B"]).build()
    assert log.p_NB_N.shape == (4, 3, 3)
    assert log.q_NB.shape == (4, 3, 4)
    assert log.rotor_speeds.shape == (3, 3, 4)
    assert log.step_ns.tolist() == [0, PERIOD_NS, 2 * PERIOD_NS]
    for (observer, target), position in FORMATION.items():
        pair = log.vehicles.index(observer), log.vehicles.index(target)
        np.testing.assert_array_equal(log.p_BB_C__ref[1][pair], position)
        np.testing.assert_allclose(log.p_BB_C__est[1][pair], np.add(position, 0.01))
    assert np.isnan(log.p_BB_C__ref[:, range(3), range(3)]).all()


def test_last_tick_without_all_vehicles_is_left_out() -> None:
    builder = perfect_builder(paper_scenario(), ["A", "A"])
    builder.add_ground_truth("leader", odometry(3 * PERIOD_NS, (0.0, 0.0, 2.0), 0.0))
    builder.add_decision(decision(3 * PERIOD_NS))
    log = builder.build()
    assert log.tick_ns.tolist() == [0, PERIOD_NS, 2 * PERIOD_NS]
    assert len(log.phase) == 2


def test_what_is_missing_is_nan() -> None:
    builder, decided = FlightLogBuilder(paper_scenario()), decision(0)
    for vehicle in ("leader", "follower_1", "follower_2"):
        builder.add_ground_truth(vehicle, odometry(0, (1.0, -2.0, 3.0), 20.0))
    builder.add_reference(PerStep(0, 0, decided.reference))
    builder.add_command("leader", decided.commands["leader"])
    assert builder.missing() is None
    log = builder.build()
    assert np.isfinite(log.rotor_speeds[0, 0]).all()
    assert np.isnan(log.rotor_speeds[0, 1:]).all()
    assert np.isnan(log.solver["kkt"]).all()
    assert np.isnan(log.p_BB_C__est).all()


def test_missing_parts_are_named() -> None:
    builder = FlightLogBuilder(paper_scenario())
    assert builder.missing() == "there is no message on /leader/ground_truth"
    for vehicle in ("leader", "follower_1", "follower_2"):
        builder.add_ground_truth(vehicle, odometry(0, (0.0, 0.0, 2.0), 0.0))
    assert builder.missing() == "there is no message on /formation/reference"
    builder.add_decision(decision(PERIOD_NS))
    assert builder.missing() == "/formation/reference and the ground truth have no instant in common"
    builder.add_decision(decision(0))
    assert builder.missing() is None


def test_faults_and_changes_are_kept_in_words() -> None:
    builder = perfect_builder(paper_scenario(), ["A"])

    def happens(step: int, source: str, content: Any) -> None:
        builder.add_event(PerStep(step, step * PERIOD_NS, Event(source, content)))

    happens(0, "/formation/controller", StepDecided((("/leader/imu", 0),), 2))
    happens(1, "follower_1", FaultReported("touches the ground"))
    happens(2, "/formation/controller", ParametersSet({"weights.formation_per_m2": 12.0, "weights.x": 0.25}))
    happens(3, "/formation/controller", FormationSet({"follower_1": (-1.0, 0.5, -0.25)}))
    log = builder.build()
    assert log.faults == (LogEntry(PERIOD_NS, "follower_1", "touches the ground"),)
    assert log.changes == (
        LogEntry(
            2 * PERIOD_NS, "/formation/controller", "set weights.formation_per_m2 = 12, weights.x = 0.25"
        ),
        LogEntry(3 * PERIOD_NS, "/formation/controller", "formation: follower_1 at [-1, 0.5, -0.25] m"),
    )


def test_spans_of_a_degraded_estimator_have_their_last_reason() -> None:
    builder = perfect_builder(paper_scenario(), ["A"] * 8)
    for step, reason in ((2, "no imu of leader for 0.5 s"), (3, "no imu of leader for 0.6 s"), (6, "a jump")):
        state = decision(step * PERIOD_NS).state
        worse = EstimatorReport(EstimatorMode.DEGRADED, reason)
        builder.add_state(PerStep(step, step * PERIOD_NS, replace(state, estimator=worse)))
    assert builder.build().degraded == (
        LogEntry(2 * PERIOD_NS, "estimator", "degraded until 0.20 s: no imu of leader for 0.6 s"),
        LogEntry(6 * PERIOD_NS, "estimator", "degraded until 0.35 s: a jump"),
    )


def test_active_constraints_by_name_and_step(tmp_path: Path) -> None:
    scenario = paper_scenario()
    builder = perfect_builder(scenario, ["A"] * 3)
    active = "keep_out leader obstacles.0"
    builder.add_decision(decision(PERIOD_NS, active_constraints=(active, "tilt leader")))
    builder.add_decision(decision(2 * PERIOD_NS, active_constraints=(active,)))
    log = builder.build()
    assert list(log.active_constraints) == [active, "tilt leader"]
    assert log.active_constraints[active].tolist() == [False, True, True]
    write_log(tmp_path / "log.npz", log)
    again = read_log(tmp_path / "log.npz", scenario)
    assert {name: steps.tolist() for name, steps in again.active_constraints.items()} == {
        active: [False, True, True],
        "tilt leader": [False, True, False],
    }
    (panel,) = constraint_panels(log)
    assert [line.name for line in panel.lines] == [active, "tilt leader"]
    np.testing.assert_array_equal(panel.lines[1].values, [np.nan, 2.0, np.nan])
    assert constraint_panels(perfect_builder(scenario, ["A"]).build()) == []


def test_leader_and_followers_are_found_by_name() -> None:
    log = perfect_builder(paper_scenario(), ["A"]).build()
    assert log.vehicles[log.leader] == "leader"
    assert [log.vehicles[index] for index in log.followers] == ["follower_1", "follower_2"]
