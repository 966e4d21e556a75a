"""What a controller reports arrives bit for bit; what cannot be used is rejected with the reason."""

import itertools
import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from relform_core.names import EstimatorMode, SolverState
from relform_core.team_config import TeamConfig
from relform_core.telemetry import (
    AlarmRaised,
    EstimatorReport,
    Event,
    FaultReported,
    FormationSet,
    LeaderEstimate,
    PairEstimate,
    ParametersSet,
    PerStep,
    SolverReport,
    StepDecided,
    TeamReference,
    TeamState,
)
from relform_ros.events import event_from_msg, event_to_msg
from relform_ros.fields import MAGNITUDE_MAX
from relform_ros.rejection import Reason, RejectionError
from relform_ros.telemetry import (
    reference_from_msg,
    reference_to_msg,
    solver_from_msg,
    solver_to_msg,
    state_from_msg,
    state_to_msg,
)
from support.wire import bits, over_the_wire

TEAM = TeamConfig(leader="leader", followers=("follower_1", "follower_2"))
VEHICLES = TEAM.vehicles
FINITE = st.floats(allow_nan=False, allow_infinity=False)
STAMPS = st.integers(0, (2**31 - 1) * 10**9 + 999_999_999)
NUMBERS = st.floats(-MAGNITUDE_MAX, MAGNITUDE_MAX)
VECTOR = arrays(np.float64, 3, elements=NUMBERS)
COUNT = st.integers(0, 2**32 - 1)
COVARIANCE = st.none() | arrays(np.float64, (4, 4), elements=st.floats(0.0, 1e300))
PAIRS = st.lists(st.sampled_from(list(itertools.permutations(VEHICLES, 2))), unique=True)
STATE = PAIRS.flatmap(
    lambda names: st.builds(
        TeamState,
        phase=st.text("ABC "),
        pairs=st.tuples(
            *(
                st.builds(
                    PairEstimate,
                    observer=st.just(observer),
                    target=st.just(target),
                    p_B1B2_C1__est=VECTOR,
                    p_B1B2_C1__ref=VECTOR,
                    yaw_I1I2=FINITE,
                    yaw_variance=st.floats(0.0, math.inf),
                    yaw_held=st.booleans(),
                    yaw_singular=st.booleans(),
                    covariance=COVARIANCE,
                )
                for observer, target in names
            )
        ),
        leader_position_error=FINITE,
        leader_yaw_error=FINITE,
        leader=st.builds(LeaderEstimate, p_NB_N=VECTOR, yaw_NB=FINITE, covariance=COVARIANCE),
        estimator=st.builds(
            EstimatorReport,
            mode=st.sampled_from(EstimatorMode),
            reason=st.text("abc "),
            nis=FINITE,
            nis_dof=st.integers(1, 2**32 - 1),
            rejected=st.lists(st.text("abc ")).map(tuple),
        ),
    )
)
REFERENCE = PAIRS.flatmap(
    lambda names: st.builds(
        TeamReference,
        phase=st.text("ABC "),
        p_NB_N=VECTOR,
        v_NB_N=VECTOR,
        yaw_NB=FINITE,
        formation=st.fixed_dictionaries(dict.fromkeys(names, VECTOR)),
    )
)
SOLVER = st.builds(
    SolverReport,
    state=st.sampled_from(SolverState),
    fallback_reason=st.text("abc "),
    objective=st.floats(),
    kkt_first=st.floats(),
    kkt=st.floats(),
    sqp_steps=COUNT,
    qp_iterations=COUNT,
    active_bounds=COUNT,
    active_constraints=st.lists(st.text("abc _")).map(tuple),
    prepare_time=FINITE,
    feedback_time=FINITE,
)
CONTENTS = st.one_of(
    st.builds(
        StepDecided,
        inputs=st.lists(st.tuples(st.sampled_from(["/leader/imu", "/follower_1/sonar"]), STAMPS)).map(tuple),
        sqp_steps=COUNT,
        waiting_for=st.text("abc "),
    ),
    st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS), min_size=2, max_size=2).map(
        lambda places: FormationSet(dict(zip(TEAM.followers, places, strict=True)))
    ),
    st.builds(ParametersSet, st.dictionaries(st.sampled_from(["weights.a", "weights.b"]), FINITE)),
    st.builds(FaultReported, st.text("abc ")),
    st.builds(AlarmRaised, st.text("abc ")),
)


def per_step(values: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    return st.builds(PerStep, step=st.integers(0, 2**64 - 1), stamp_ns=STAMPS, value=values)


@given(per_step(STATE))
def test_state_roundtrip(state: PerStep[TeamState]) -> None:
    assert bits(state_from_msg(over_the_wire(state_to_msg(state)), VEHICLES)) == bits(state)


def test_state_without_innovations_and_of_an_older_version() -> None:
    leader = LeaderEstimate(np.array([1.0, -2.0, 3.0]), 7.5, None)
    quiet = TeamState("A", (), 0.5, -0.25, leader, EstimatorReport(EstimatorMode.DEGRADED, "no IMU"))
    older = TeamState("A", (), 0.5, -0.25)
    for state in (quiet, older):
        step = PerStep(7, 350_000_000, state)
        assert bits(state_from_msg(over_the_wire(state_to_msg(step)), VEHICLES)) == bits(step)


@given(per_step(REFERENCE))
def test_reference_roundtrip(reference: PerStep[TeamReference]) -> None:
    assert bits(reference_from_msg(over_the_wire(reference_to_msg(reference)), VEHICLES)) == bits(reference)


@given(per_step(SOLVER))
def test_solver_roundtrip(report: PerStep[SolverReport]) -> None:
    assert bits(solver_from_msg(over_the_wire(solver_to_msg(report)))) == bits(report)


@given(
    per_step(st.builds(Event, source=st.sampled_from(["leader", "/formation/controller"]), content=CONTENTS))
)
def test_event_roundtrip(event: PerStep[Event]) -> None:
    assert bits(event_from_msg(over_the_wire(event_to_msg(event, TEAM)), TEAM)) == bits(event)


def state_message() -> Any:
    position = np.array([1.5, -2.5, 3.5])
    pairs = tuple(
        PairEstimate(observer, target, position, position, 0.25, 0.04, False, True, np.eye(4))
        for observer, target in itertools.permutations(VEHICLES, 2)
    )
    leader = LeaderEstimate(position, 1.5, np.diag([0.25, 0.5, 0.75, 1.0]))
    estimator = EstimatorReport(EstimatorMode.PREDICTED, "no sonar of leader", 12.5, 18, ("one", "two"))
    return state_to_msg(PerStep(7, 350_000_000, TeamState("A", pairs, 0.5, -0.25, leader, estimator)))


def reference_message() -> Any:
    position = np.array([1.5, -2.5, 3.5])
    formation = dict.fromkeys(itertools.permutations(VEHICLES, 2), position)
    return reference_to_msg(PerStep(7, 350_000_000, TeamReference("A", position, position, 1.5, formation)))


def solver_message() -> Any:
    report = SolverReport(SolverState.SOLVED, "", 12.5, 80.0, 0.5, 2, 7, 3, (), 0.002, 0.001)
    return solver_to_msg(PerStep(7, 350_000_000, report))


def event_message(content: Any) -> Any:
    return event_to_msg(PerStep(7, 350_000_000, Event("leader", content)), TEAM)


def step_message() -> Any:
    return event_message(StepDecided((("/leader/imu", 350_000_000),), 2))


def formation_message() -> Any:
    return event_message(FormationSet({"follower_1": (-1.0, -0.5, 0.0), "follower_2": (-1.0, 0.5, 0.0)}))


def parameters_message() -> Any:
    return event_message(ParametersSet({"weights.a": 2.0}))


def take_state(message: Any) -> Any:
    return state_from_msg(message, VEHICLES)


def take_reference(message: Any) -> Any:
    return reference_from_msg(message, VEHICLES)


def take_event(message: Any) -> Any:
    return event_from_msg(message, TEAM)


KINDS: dict[str, tuple[Callable[[], Any], Callable[[Any], Any]]] = {
    "state": (state_message, take_state),
    "reference": (reference_message, take_reference),
    "solver": (solver_message, solver_from_msg),
    "step": (step_message, take_event),
    "formation": (formation_message, take_event),
    "parameters": (parameters_message, take_event),
}


@pytest.mark.parametrize("kind", KINDS)
def test_the_unchanged_messages_are_accepted(kind: str) -> None:
    make, take = KINDS[kind]
    taken = take(over_the_wire(make()))
    assert (taken.step, taken.stamp_ns) == (7, 350_000_000)


NAN, INF = math.nan, math.inf


@pytest.mark.parametrize(
    ("kind", "spoil", "reason", "says"),
    [
        ("state", "header.frame_id = 'map'", Reason.FOREIGN, "frame_id must be '' (got 'map')"),
        ("state", "header.stamp.sec = -1", Reason.INVALID, "no valid stamp"),
        ("state", "pairs[0].target_id = 'ufo'", Reason.FOREIGN, "'leader' and 'ufo' are no two vehicles of"),
        ("state", "pairs[0].target_id = 'leader'", Reason.FOREIGN, "'leader' and 'leader' are no two"),
        ("state", "pairs[0].target_id = 'follower_2'", Reason.INVALID, "'follower_2' is named twice"),
        (
            "state",
            "pairs[0].position.y = nan",
            Reason.INVALID,
            "position of 'follower_1' seen by 'leader'",
        ),
        ("state", "pairs[0].reference.z = inf", Reason.INVALID, "reference of 'follower_1' seen by 'leader'"),
        (
            "state",
            "pairs[0].yaw = nan",
            Reason.INVALID,
            "yaw of 'follower_1' seen by 'leader' must be finite",
        ),
        ("state", "pairs[0].yaw_variance = nan", Reason.INVALID, "must not be negative (got nan)"),
        ("state", "pairs[0].yaw_variance = -0.5", Reason.INVALID, "must not be negative (got -0.5)"),
        ("state", "leader_position_error = nan", Reason.INVALID, "leader_position_error must be finite"),
        ("state", "leader_yaw_error = inf", Reason.INVALID, "leader_yaw_error must be finite (got inf)"),
        ("state", "pairs[0].covariance[5] = nan", Reason.INVALID, "covariance of 'follower_1' seen by"),
        ("state", "leader_position.z = nan", Reason.INVALID, "leader_position must be finite"),
        ("state", "leader_yaw = inf", Reason.INVALID, "leader_yaw must be finite"),
        (
            "state",
            "leader_covariance[15] = -0.5",
            Reason.INVALID,
            "leader_covariance must not have negative variances",
        ),
        (
            "state",
            "estimator_mode = 7",
            Reason.INVALID,
            "estimator_mode must be one of 0 (MEASURED), 1 (PREDICTED), 2 (DEGRADED) (got 7)",
        ),
        ("state", "nis = nan", Reason.INVALID, "nis must be finite"),
        ("reference", "header.frame_id = ''", Reason.FOREIGN, "frame_id must be 'map' (got '')"),
        ("reference", "leader_position.x = nan", Reason.INVALID, "leader_position must be finite"),
        ("reference", "leader_velocity.x = inf", Reason.INVALID, "leader_velocity must be finite"),
        ("reference", "leader_yaw = nan", Reason.INVALID, "leader_yaw must be finite (got nan)"),
        (
            "reference",
            "formation[1].observer_id = 'ufo'",
            Reason.FOREIGN,
            "'ufo' and 'follower_2' are no two",
        ),
        ("reference", "formation[1].position.x = nan", Reason.INVALID, "'follower_2' relative to 'leader'"),
        ("solver", "header.frame_id = 'map'", Reason.FOREIGN, "frame_id must be ''"),
        ("solver", "status = 3", Reason.INVALID, "status must be one of 0 (SOLVED), 1 (STEP_LIMIT), 2 (FALL"),
        ("solver", "prepare_time = nan", Reason.INVALID, "prepare_time must be finite"),
        ("solver", "feedback_time = inf", Reason.INVALID, "feedback_time must be finite"),
        ("step", "kind = 99", Reason.INVALID, "kind must be one of 0 (STEP), 1 (SET_FORMATION), 2 (FAULT)"),
        (
            "step",
            "input_topics = []",
            Reason.INVALID,
            "input_topics and input_stamps must have the same length",
        ),
        ("step", "input_stamps[0].sec = -1", Reason.INVALID, "no valid stamp"),
        ("formation", "formation[0].observer_id = 'ufo'", Reason.INVALID, "must be the leader 'leader' (got"),
        ("formation", "formation[1].target_id = 'follower_1'", Reason.INVALID, "'follower_1' is named twice"),
        (
            "formation",
            "formation[1].position.x = nan",
            Reason.INVALID,
            "position of 'follower_2' must be fin",
        ),
        ("parameters", "parameter_values = []", Reason.INVALID, "must have the same length (got 1, 0)"),
    ],
)
def test_unusable_messages_are_rejected(kind: str, spoil: str, reason: Reason, says: str) -> None:
    make, take = KINDS[kind]
    message = make()
    exec(f"message.{spoil}", {"message": message, "nan": NAN, "inf": INF})
    with pytest.raises(RejectionError, match=re.escape(says)) as error:
        take(over_the_wire(message))
    assert error.value.reason is reason
    assert "\n" not in str(error.value)
