"""The geofence in the controller: what is refused, where the team brakes to, and what the estimates say."""

import math
import re
from typing import Any

import numpy as np
import pytest

from relform_controller.estimation.estimator import TeamCovariances, TeamEstimate
from relform_controller.geofence_watch import GeofenceWatch, world_places
from relform_controller.ocp.problem import TeamGeometry
from relform_controller.reference.fence import check_scenario
from relform_controller.reference.form_up import StartPoses
from relform_controller.reference.mission import ScenarioMission
from relform_controller.reference.online_mission import OnlineMission
from relform_core.errors import ConfigError
from relform_core.geofence_config import GeofenceConfig
from relform_core.names import EstimatorMode
from relform_core.telemetry import EstimatorReport
from support.scenarios import paper_scenario

PERIOD_NS = 50_000_000
FENCE = "geofence={x_m: [-40, 40], y_m: [-40, 40], height_max_m: 20}"
INITIAL = {"follower_1": (-1.0, -0.5, -0.5), "follower_2": (-1.0, 0.5, -0.5)}


def refused(*overrides: str) -> str:
    with pytest.raises(ConfigError) as caught:
        check_scenario(paper_scenario(FENCE, *overrides).config)
    return str(caught.value)


def test_the_phases_are_checked_before_the_flight() -> None:
    check_scenario(paper_scenario().config)
    check_scenario(paper_scenario(FENCE).config)
    assert re.fullmatch(
        r"'leader' would leave the geofence: x = \d+\.\d\d m, at most 4\.70 m \(geofence\.x_m\)",
        refused("geofence.x_m=[-10.0, 5.0]"),
    )
    with pytest.raises(ConfigError, match="'leader' would leave the geofence"):
        ScenarioMission(paper_scenario(FENCE, "geofence.x_m=[-10.0, 5.0]").config)


def test_a_follower_is_checked_where_the_team_turns() -> None:
    """The leader stays; the followers, 6 m to its side, swing around it."""
    turn = (
        "phases=[{name: P, title: hover, duration_s: 1.0, steady_from_s: 0.5, formation: initial, motion: "
        "{kind: hover, ramp_s: 0.0}}, {name: Q, title: turn, duration_s: 4.0, steady_from_s: 3.5, "
        "formation: initial, motion: {kind: turn, angle_deg: 90.0, turn_s: 3.0}}]",
        "formations_m={initial: {follower_1: [0.0, -6.0, 0.0], follower_2: [-1.0, 0.0, 0.0]}}",
    )
    assert refused(*turn, "geofence.x_m=[-5, 5]") == (
        "'follower_1' would leave the geofence: x = 6.00 m, at most 4.70 m (geofence.x_m)"
    )
    check_scenario(paper_scenario(FENCE, *turn, "geofence.x_m=[-5, 6.4]").config)


class Online:
    """A mission that rests at x = 1 m, y = -0.5 m, z = 1.8 m, with a yaw of 0.4 rad."""

    def __init__(self, *overrides: str) -> None:
        self.mission = OnlineMission(paper_scenario("ground={}", FENCE, *overrides).config)
        places = np.array([(0.0, 0.0, 0.0), *INITIAL.values()])
        self.mission.hold(StartPoses(places, np.zeros(3), np.array([1.0, -0.5, 1.8]), 0.4))
        self.step = -1
        self.fly(0.1)

    def fly(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.05)):
            self.step += 1
            self.mission.advance(self.step * PERIOD_NS)

    @property
    def leader(self) -> np.ndarray:
        return self.mission.reference(np.array([self.step * PERIOD_NS])).leader.p_NB_N[0]


def says(vehicle: str, breach: str) -> Any:
    return pytest.raises(ConfigError, match=re.escape(f"'{vehicle}' would leave the geofence: {breach}"))


def test_requests_that_leave_it_are_refused_by_name_value_and_bound() -> None:
    online = Online("geofence.y_m=[-6.0, 6.0]", "geofence.height_max_m=5.0")
    mission = online.mission
    with says("leader", "z = 4.90 m, at most 4.70 m (geofence.height_max_m)"):
        mission.go_to(np.array([3.0, 0.0, 4.9]), math.nan)
    # The formation keeps its yaw of 0.4 rad.
    left = -math.sin(0.4) + 0.5 * math.cos(0.4)
    assert 0.0 < left < 0.1
    with says("follower_2", f"y = {5.67 + left:.2f} m, at most 5.70 m"):
        mission.go_to(np.array([3.0, 5.67, 2.0]), math.nan)
    right = -math.sin(0.4) - 0.5 * math.cos(0.4)
    with says("follower_1", f"y = {right - 7.0:.2f} m, at least -5.70 m"):
        mission.follow_trajectory(np.array([[0.5, 1.0, -0.5, 1.8, 0.4], [12.0, 1.0, -7.0, 2.0, 0.4]]))
    with says("follower_1", "z = 4.7"):  # on its way up to 4.8 m
        mission.set_formation(INITIAL | {"follower_1": (-1.0, -0.5, 3.0)})
    with pytest.raises(ConfigError, match="would leave the geofence: y = "):
        mission.start()
    online.fly(0.2)
    assert online.leader == pytest.approx([1.0, -0.5, 1.8])
    mission.go_to(np.array([3.0, 5.5, 2.0]), math.nan)


def test_a_team_that_brakes_ends_inside() -> None:
    online = Online("geofence.x_m=[-9.0, 4.5]")
    online.mission.go_to(np.array([4.15, -0.5, 1.8]), 0.4)
    online.fly(2.0)
    assert online.leader[0] > 2.0
    online.mission.halt()
    online.fly(4.0)
    assert online.mission.is_resting
    assert online.leader[0] <= 4.2 + 1e-9


def test_the_phases_of_a_scenario_end_with_a_halt() -> None:
    config = paper_scenario(FENCE).config
    halted, free = ScenarioMission(config), ScenarioMission(config)
    last = config.n_steps - 1
    for step in range(last + 1):
        if step == 41:
            halted.halt()
        halted.advance(step * PERIOD_NS)
        free.advance(step * PERIOD_NS)
    at = np.array([40, 41, 60, last]) * PERIOD_NS
    found, planned = halted.reference(at).leader, free.reference(at).leader
    np.testing.assert_allclose(found.p_NB_N[1], planned.p_NB_N[1], atol=1e-9)  # no jump
    np.testing.assert_allclose(found.v_NB_N[1], planned.v_NB_N[1], atol=1e-9)
    assert np.linalg.norm(planned.v_NB_N[1]) > 0.5
    assert found.v_NB_N[3] == pytest.approx(np.zeros(3))
    limits = config.controller.leader_motion
    speed = np.linalg.norm(planned.v_NB_N[1])
    braked = np.linalg.norm(found.p_NB_N[3] - planned.p_NB_N[1])
    assert braked == pytest.approx(2.0 * speed**2 / (3.0 * limits.acceleration_max))
    assert halted.formation == config.formations[config.phases[0].formation]
    assert free.formation == config.formations[config.phases[-1].formation]


def estimate(covariances: TeamCovariances | None = None) -> TeamEstimate:
    """Leader at (1, 2, 3) with a yaw of 90 deg; one follower 2 m ahead of it and 1 m to its left."""
    geometry = TeamGeometry(
        np.array([[2.0, 1.0, 0.5], [0.0, 0.0, 0.0]]),
        np.zeros(2),
        np.array([1.0, 2.0, 3.0]),
        math.pi / 2.0,
    )
    return TeamEstimate(
        np.zeros((2, 12)),
        geometry,
        np.zeros(2),
        (False, False),
        EstimatorReport(EstimatorMode.MEASURED, ""),
        covariances=covariances,
    )


def test_places_in_the_world_with_their_deviations() -> None:
    pairs = np.array([np.diag([0.04, 0.01, 0.09, 0.5]), np.zeros((4, 4))])
    covariances = TeamCovariances(pairs, np.diag([0.0025, 0.0036, 0.0049, 0.01]))
    places, stds = world_places(estimate(covariances), 2)
    assert places == pytest.approx(np.array([[1.0, 2.0, 3.0], [0.0, 4.0, 3.5]]))
    assert stds[0] ** 2 == pytest.approx([0.0025, 0.0036, 0.0049])
    # Turned by 90 deg; the yaw moves the follower, at (-1, 2) from the leader, by 2 m and 1 m per radian.
    assert stds[1] ** 2 == pytest.approx(
        [0.0025 + 0.01 + 0.01 * 4.0, 0.0036 + 0.04 + 0.01 * 1.0, 0.0049 + 0.09]
    )
    assert world_places(estimate(), 2)[1].tolist() == [[0.0] * 3] * 2


def test_what_is_outside_and_what_may_be() -> None:
    fence = GeofenceConfig(x_m=(-3.0, 3.0), y_m=(-9.0, 4.1), height_max_m=3.4)
    watch = GeofenceWatch(("leader", "f1"), fence)
    assert watch.outside(estimate()) == {
        "f1": "is outside the geofence: z = 3.50 m, at most 3.40 m (geofence.height_max_m)"
    }
    sure = TeamCovariances(np.zeros((2, 4, 4)), 1e-4 * np.eye(4))
    unsure = TeamCovariances(np.zeros((2, 4, 4)), np.diag([0.0, 0.0, 0.04, 0.0]))
    higher = fence.model_copy(update={"height_max": 3.6})
    assert GeofenceWatch(("leader", "f1"), higher).outside(estimate(sure)) == {}
    assert GeofenceWatch(("leader", "f1"), higher).outside(estimate(unsure)) == {
        "f1": "may be outside the geofence: z = 3.50 m, at most 3.20 m (geofence.height_max_m)"
    }
