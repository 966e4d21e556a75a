"""Teams that are asked for anything at any time: defined states, no collision, refusals change nothing."""

import itertools
import math
import os

import numpy as np
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from relform_analysis.flight.metrics import separations
from relform_analysis.flight.simulate import simulate
from relform_controller.flight_director import FlightDirector
from relform_core.errors import ConfigError
from relform_core.flight_modes import TeamMode, TeamRequest, refusal
from relform_core.load import load_scenario
from relform_core.schema import Vector3
from relform_core.telemetry import RequestMade
from support.scenarios import CONFIG_FOLDER

EXAMPLES = int(os.environ.get("RELFORM_REQUEST_FLIGHTS", "15"))
"""Number of random flights."""
SCENARIO = load_scenario(
    CONFIG_FOLDER / "scenarios/field.yaml",
    ["ground={waits: true, time_s: 60, climb_speed_m_s: 1.0, descent_speed_m_s: 0.8, interval_s: 0.5}"],
    seed=5,
)
SETTLED_S = 2.0
"""Time that is flown after the last request."""
NEXT = {
    TeamMode.IDLE: {TeamMode.TAKING_OFF, TeamMode.LANDING},  # asked to take off and to land in one step
    TeamMode.TAKING_OFF: {TeamMode.HOVERING, TeamMode.LANDING},
    TeamMode.HOVERING: {TeamMode.FLYING, TeamMode.LANDING},
    TeamMode.FLYING: {TeamMode.HOVERING, TeamMode.LANDING},
    TeamMode.LANDING: {TeamMode.IDLE},
}
"""Where a mode may lead without an emergency; no vehicle is lost here."""

Act = RequestMade | dict[str, Vector3]
"""A request, or a formation."""

place = st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0), st.floats(-0.5, 3.0))
angle = st.floats(-math.pi, math.pi) | st.just(math.nan)
triggers = [
    each
    for each in TeamRequest
    if each not in (TeamRequest.GO_TO, TeamRequest.FOLLOW_TRAJECTORY, TeamRequest.SET_FORMATION)
]
acts: st.SearchStrategy[Act] = st.one_of(
    st.sampled_from(triggers).map(RequestMade),
    st.builds(lambda p, yaw: RequestMade(TeamRequest.GO_TO, (*p, yaw)), place, angle),
    st.builds(
        lambda points: RequestMade(
            TeamRequest.FOLLOW_TRAJECTORY,
            tuple(value for index, (p, yaw) in enumerate(points) for value in (2.0 + 4.0 * index, *p, yaw)),
        ),
        st.lists(st.tuples(place, angle), min_size=1, max_size=3),
    ),
    st.fixed_dictionaries(
        {
            "follower_1": st.tuples(st.floats(-2.0, 0.0), st.floats(-2.0, -0.6), st.floats(-0.8, 0.8)),
            "follower_2": st.tuples(st.floats(-2.0, 0.0), st.floats(0.6, 2.0), st.floats(-0.8, 0.8)),
        }
    ),
)
plans = st.lists(st.tuples(acts, st.floats(0.0, 5.0)), min_size=1, max_size=12)


def ask(director: FlightDirector, act: Act) -> None:
    """Make a request; whether it is refused is what the table says, or has another reason that is given."""
    mode, formation = director.mode, dict(director.formation)
    request = act.request if isinstance(act, RequestMade) else TeamRequest.SET_FORMATION
    problem = refusal(request, mode)
    try:
        if isinstance(act, RequestMade):
            director.request(act)
        else:
            director.set_formation(act)
    except ConfigError as error:
        refused = str(error)
    else:
        refused = ""
    if refused:
        assert (director.mode, dict(director.formation)) == (mode, formation)
        assert problem in (None, refused)
    else:
        assert problem is None or (request is TeamRequest.SET_FORMATION and act == formation)


@settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(plans)
@example([(RequestMade(TeamRequest.EMERGENCY_LAND), 0.0)])
@example([(RequestMade(TeamRequest.TAKE_OFF), 0.05), (RequestMade(TeamRequest.EMERGENCY_LAND), 0.0)])
def test_any_sequence_of_requests_is_flown_or_refused(plan: list[tuple[Act, float]]) -> None:
    director = FlightDirector(SCENARIO.config)
    queue = [(RequestMade(TeamRequest.TAKE_OFF), 0.0), *plan]
    modes, positions = [TeamMode.IDLE], []
    due, emergency = 0.1, False
    for step in simulate(SCENARIO, director):
        positions.append(np.array([each.p_NB_N for each in step.ground_truth.values()]))
        if step.status is None:
            assert emergency or not step.faults, step.faults
            break
        if step.status.mode is not modes[-1]:
            modes.append(step.status.mode)
        time = step.measurements.arrival_ns / 1e9
        if not queue and time > due + SETTLED_S:
            break
        while queue and time >= due:
            act, pause = queue.pop(0)
            ask(director, act)
            due += pause
            emergency |= isinstance(act, RequestMade) and act.request is TeamRequest.EMERGENCY_STOP
    for before, after in itertools.pairwise(modes):
        assert after in NEXT[before] or after is TeamMode.STOPPED, modes
    if not emergency:
        apart = separations(np.array(positions)).min()
        assert apart > SCENARIO.config.vehicle.separation_min
