"""What the scene shows of a flight, by hand-made messages."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_controller.reference.trajectory import LeaderTrajectory
from relform_core.names import EstimatorMode, SolverState
from relform_core.telemetry import Event, FaultReported, ParametersSet, PerStep
from relform_live.scene.colours import UNSEEN, of_errors
from relform_live.scene.flight_data import LOG_LINES, FlightData, Severity
from relform_live.scene.stage import AHEAD_POINTS, AHEAD_SPACING_NS, Stage
from relform_live.scene.trail import POINTS, Trail
from support.live_flights import (
    YAW,
    bearings,
    flown,
    leader_place,
    nanoseconds,
    odometry,
    paper_config,
    place_of,
    reference,
    solver,
    state,
)

VEHICLES = ("leader", "follower_1", "follower_2")
ERROR = np.array([0.06, 0.0, 0.08])
"""Of follower_1 [m]: 0.1 m."""


def test_nothing_is_known_before_the_first_messages() -> None:
    picture = Stage(FlightData(paper_config())).picture(0)
    assert (picture.truth, picture.estimate, picture.targets, picture.links) == (None, None, None, None)


def test_vehicles_are_where_they_were_at_the_shown_time() -> None:
    data = flown(until=1.0)
    picture = Stage(data).picture(nanoseconds(0.975))  # between two steps
    assert picture.truth is not None
    assert picture.truth.p_NB_N == pytest.approx(np.array([place_of(name, 0.975) for name in VEHICLES]))
    w, x, y, z = picture.truth.wxyz_NB[1]
    assert Rotation.from_quat([x, y, z, w]).as_euler("ZYX") == pytest.approx([YAW - 1.9, 0.1, -0.2])


def test_ghosts_are_where_the_controller_believes() -> None:
    picture = Stage(flown(until=1.0)).picture(nanoseconds(1.0))
    assert picture.estimate is not None
    ahead = Rotation.from_euler("z", YAW).apply([0.05, 0.0, 0.0])
    assert picture.estimate.p_NB_N[0] == pytest.approx(leader_place(1.0) + [0.0, 0.0, 0.1])
    assert picture.estimate.p_NB_N[1] == pytest.approx(place_of("follower_1", 1.0) + ahead + [0.0, 0.0, 0.1])
    w, x, y, z = picture.estimate.wxyz_NB[2]
    assert Rotation.from_quat([x, y, z, w]).as_euler("ZYX") == pytest.approx([YAW - 1.9, 0.0, 0.0])


def test_targets_are_the_reference_and_the_places_around_the_leader() -> None:
    picture = Stage(flown(until=1.0, error=ERROR)).picture(nanoseconds(1.0))
    assert picture.targets is not None
    assert picture.targets[0] == pytest.approx(leader_place(1.0) + [0.0, 0.3, 0.4])
    assert picture.targets[1] == pytest.approx(place_of("follower_1", 1.0))


def test_the_path_ahead_is_that_of_the_scenario() -> None:
    data = flown(until=1.0)
    path = LeaderTrajectory(data.config, 0)
    instants = nanoseconds(3.0) + np.arange(1, AHEAD_POINTS + 1) * AHEAD_SPACING_NS
    now = path.at(np.array([nanoseconds(3.0)]))
    team = replace(reference(3.0).value, p_NB_N=now.p_NB_N[0], v_NB_N=now.v_NB_N[0])
    data.take_reference(PerStep(60, nanoseconds(3.0), team))
    picture = Stage(data).picture(nanoseconds(1.0))
    assert picture.ahead == pytest.approx(path.at(instants).p_NB_N)


def test_nothing_is_ahead_of_a_leader_that_is_sent_elsewhere() -> None:
    picture = Stage(flown(until=1.0)).picture(nanoseconds(1.0))
    assert picture.ahead == pytest.approx(np.tile(leader_place(1.0) + [0.0, 0.3, 0.4], (AHEAD_POINTS, 1)))


def test_links_join_the_vehicles_and_have_the_colour_of_the_error() -> None:
    data = flown(until=1.0, error=ERROR)
    stage = Stage(data)
    links = stage.picture(nanoseconds(1.0)).links
    assert links is not None
    assert stage.edges == (("leader", "follower_1"), ("leader", "follower_2"), ("follower_1", "follower_2"))
    assert links.segments[0, 1] == pytest.approx(place_of("follower_1", 1.0) + ERROR)
    assert links.colours[0] == pytest.approx(of_errors(np.array([0.1]))[0], abs=1)
    assert links.colours[1] == pytest.approx(of_errors(np.array([0.0]))[0], abs=1)
    assert tuple(links.colours[2]) == UNSEEN  # the reference names no such pair


def test_a_link_over_which_nothing_is_seen_is_grey() -> None:
    data = flown(until=1.0)
    data.take_sightings("leader", bearings(1.0, "follower_2"))
    data.take_sightings("follower_1", bearings(0.5, "leader", "follower_2"))  # long ago
    links = Stage(data).picture(nanoseconds(1.0)).links
    assert links is not None
    assert tuple(links.colours[0]) == UNSEEN
    assert tuple(links.colours[1]) != UNSEEN


def test_true_errors() -> None:
    data = flown(until=1.0, error=ERROR)
    errors = data.formation_errors()
    assert errors["leader", "follower_1"] == pytest.approx(0.1)
    assert errors["follower_1", "leader"] == pytest.approx(0.1)
    assert errors["leader", "follower_2"] == pytest.approx(0.0, abs=1e-9)
    assert data.leader_error() == pytest.approx(0.5)


def test_trails_follow_the_vehicles_and_have_a_fixed_size() -> None:
    data = flown(until=1.0)
    stage = Stage(data)
    for time in (0.3, 0.6, 1.0):
        stage.picture(nanoseconds(time))
    segments = stage.trails["follower_1"].segments
    assert segments.shape == (POINTS - 1, 2, 3)
    assert segments[-1, 1] == pytest.approx(place_of("follower_1", 1.0))
    assert segments[-1, 0] == pytest.approx(place_of("follower_1", 0.9))
    assert segments[0] == pytest.approx(np.tile(place_of("follower_1", 0.0), (2, 1)))


def test_trails_begin_again_after_a_jump_back() -> None:
    stage = Stage(flown(until=1.0))
    stage.picture(nanoseconds(1.0))
    stage.picture(nanoseconds(0.2))
    assert stage.trails["leader"].segments[-1, 1] == pytest.approx(leader_place(0.2))
    assert stage.trails["leader"].segments[0, 0] == pytest.approx(leader_place(0.0))


def test_a_trail_is_as_long_as_its_points() -> None:
    trail = Trail()
    for step in range(20 * 60):
        trail.add(nanoseconds(step / 20.0), np.array([step / 20.0, 0.0, 1.0]))
    assert trail.segments[0, 0, 0] == pytest.approx(59.9 - 0.1 * (POINTS - 1))


def test_the_log_names_phases_faults_and_fallbacks_once() -> None:
    data = FlightData(paper_config())
    for time, phase in ((0.0, "A"), (0.05, "A"), (0.1, "B")):
        data.take_state(state(time, phase))
    for time in (0.2, 0.25):
        data.take_solver(solver(time, SolverState.FALLBACK, "QP is infeasible"))
        data.take_state(state(time, "B", EstimatorMode.DEGRADED, "no localization for 1.0 s"))
    data.take_event(PerStep(6, nanoseconds(0.3), Event("follower_2", FaultReported("hit the ground"))))
    changes = {"weights.formation_per_m2": 20.0}
    data.take_event(PerStep(6, nanoseconds(0.3), Event("/formation/controller", ParametersSet(changes))))
    assert [(line.text, line.severity) for line in data.log] == [
        ("phase A", Severity.NOTE),
        ("phase B", Severity.NOTE),
        ("solver fell back: QP is infeasible", Severity.WARNING),
        ("estimator degraded: no localization for 1.0 s", Severity.WARNING),
        ("follower_2: hit the ground", Severity.ERROR),
        ("/formation/controller: weights.formation_per_m2 = 20.0", Severity.NOTE),
    ]
    assert data.fallbacks == 2


def test_the_log_is_bounded() -> None:
    data = FlightData(paper_config())
    for step in range(10 * LOG_LINES):
        data.note(step, f"line {step}")
    assert len(data.log) == LOG_LINES


def test_newest_instant_is_that_of_which_all_is_known() -> None:
    data = FlightData(paper_config())
    data.take_truth("leader", odometry("leader", 0.10))
    data.take_truth("follower_1", odometry("follower_1", 0.10))
    assert data.newest_ns is None
    data.take_truth("follower_2", odometry("follower_2", 0.05))
    assert data.newest_ns == nanoseconds(0.05)
