"""The level of a node, from what it counts and from what holds."""

import pytest

from relform_core.health import COUNTS, Health, Level
from relform_sim.onboard import OnboardCounts

VEHICLE = vars(OnboardCounts())
CONTROLLER = {
    "solver.solved": 20,
    "solver.step_limit": 0,
    "solver.fallback": 0,
    "solver.last_fallback_reason": "",
    "estimator.waiting_for": "",
    "estimator.mode": "measured",
    "estimator.reason": "",
    "estimator.nis_dof": 18,
}


def judged(*reports: dict[str, object]) -> list[tuple[Level, str]]:
    health = Health()
    return [health.judge(report, 0, "") for report in reports]


def test_a_node_without_findings_is_ok() -> None:
    assert judged({}, VEHICLE, CONTROLLER) == [(Level.OK, "")] * 3


def test_a_vehicle_that_has_no_command_yet_is_stale() -> None:
    waiting, flying = judged(VEHICLE | {"hovered": 3}, VEHICLE | {"hovered": 3})
    assert waiting == (Level.STALE, "no command has arrived yet, the vehicle hovers")
    assert flying == (Level.OK, "")


def test_a_vehicle_recovers_from_lost_commands() -> None:
    levels = judged(
        VEHICLE | {"replayed": 4},
        VEHICLE | {"replayed": 4},
        VEHICLE | {"replayed": 24, "failsafe": 5},
    )
    assert levels == [
        (Level.WARN, "intervals on the plan of an earlier command: 4"),
        (Level.OK, ""),
        (
            Level.ERROR,
            "intervals without a plan: 5, the vehicle sinks on its own sensors; "
            "intervals on the plan of an earlier command: 20",
        ),
    ]


def test_fallbacks_of_the_solver_are_a_warning_and_an_error_if_there_is_nothing_else() -> None:
    reason = {"solver.last_fallback_reason": "not finite"}
    some = CONTROLLER | {"solver.solved": 37, "solver.fallback": 3} | reason
    only = some | {"solver.fallback": 23}
    assert judged(CONTROLLER, some, only, only) == [
        (Level.OK, ""),
        (Level.WARN, "steps that fell back to the plan before: 3, not finite"),
        (Level.ERROR, "steps that fell back to the plan before: 20, not finite"),
        (Level.OK, ""),
    ]


def test_a_degraded_estimate_is_a_warning_while_it_lasts() -> None:
    degraded = {"estimator.mode": "degraded", "estimator.reason": "no localization for 1.2 s"}
    assert judged(CONTROLLER | degraded, CONTROLLER | degraded, CONTROLLER) == [
        (Level.WARN, "the estimate is degraded: no localization for 1.2 s"),
        (Level.WARN, "the estimate is degraded: no localization for 1.2 s"),
        (Level.OK, ""),
    ]


def test_a_controller_that_lacks_measurements_is_stale() -> None:
    waiting = {"estimator.waiting_for": "range and bearing from leader to follower_1"}
    assert judged(CONTROLLER | waiting) == [
        (Level.STALE, "waits for range and bearing from leader to follower_1")
    ]


@pytest.mark.parametrize(
    ("mode", "level", "message"),
    [
        ("idle", Level.OK, "waits for take_off"),
        ("failsafe", Level.ERROR, "the team is in failsafe: follower_1 is lost; waits for take_off"),
    ],
)
def test_a_team_may_wait_for_a_request_and_must_not_be_in_failsafe(
    mode: str, level: Level, message: str
) -> None:
    team = {
        "team.mode": mode,
        "team.reason": "follower_1 is lost",
        "estimator.waiting_for": "take_off",
        "requests.refused": 0,
    }
    assert judged(CONTROLLER | team) == [(level, message)]


def test_rejected_messages_are_a_warning_until_none_is_rejected() -> None:
    health = Health()
    assert health.judge({}, 2, "/leader/imu: not finite") == (
        Level.WARN,
        "rejected messages: 2, the last: /leader/imu: not finite",
    )
    assert health.judge({}, 2, "/leader/imu: not finite") == (Level.OK, "")


def test_steps_that_members_missed_are_named() -> None:
    missed = "real_time.missed_steps."
    levels = judged(
        {f"{missed}/leader/quadrotor": 0, f"{missed}/recorder": 0},
        {f"{missed}/leader/quadrotor": 2, f"{missed}/recorder": 0},
    )
    assert levels[1] == (Level.WARN, "steps that /leader/quadrotor missed: 2")


def test_vehicles_count_what_is_judged() -> None:
    assert {count.key for count in COUNTS if "." not in count.key} <= VEHICLE.keys()


@pytest.mark.parametrize(
    ("values", "finding"),
    [
        ({"thrust_percent": 71.4}, (Level.WARN, "thrust 71 % of nominal")),
        ({"thrust_percent": 85.0}, (Level.OK, "")),
        ({"evaded": 3}, (Level.WARN, "intervals in which another vehicle was too close: 3")),
        ({"lowered": 2}, (Level.WARN, "intervals above the geofence: 2")),
        ({"separation.level": "ok", "separation": "a and b are 2.00 m apart"}, (Level.OK, "")),
        (
            {"separation.level": "warning", "separation": "a and b are 0.80 m apart"},
            (Level.WARN, "separation: a and b are 0.80 m apart"),
        ),
        (
            {"separation.level": "emergency", "separation": "a and b are 0.60 m apart"},
            (Level.ERROR, "separation: a and b are 0.60 m apart"),
        ),
        ({"geofence": ""}, (Level.OK, "")),
        ({"geofence": "a is outside"}, (Level.ERROR, "geofence: a is outside")),
    ],
)
def test_limits_in_flight(values: dict[str, object], finding: tuple[Level, str]) -> None:
    assert Health().judge(values, 0, "") == finding
