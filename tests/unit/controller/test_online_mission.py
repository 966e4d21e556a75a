"""The mission that takes requests: what the leader and the formation do after each, and what is refused."""

import math
import re

import numpy as np
import pytest

from relform_controller.reference.form_up import StartPoses
from relform_controller.reference.online_mission import OnlineMission
from relform_controller.reference.trajectory import LeaderTrajectory
from relform_core.errors import ConfigError
from support.scenarios import paper_scenario

PERIOD_NS = 50_000_000
OBSTACLE = "obstacles=[{kind: sphere, center_m: [3.0, 1.0, 1.5], radius_m: 0.5}]"
PLACES = np.array([[0.0, 0.0, 0.0], [-1.05, -0.45, -0.52], [-0.95, 0.55, -0.47]])
POSES = StartPoses(PLACES, np.array([0.0, 0.2, -0.3]), np.array([1.0, -0.5, 1.8]), 0.4)
WIDE = {"follower_1": (-1.0, -0.75, -0.5), "follower_2": (-1.0, 0.75, -0.5)}


class Flown:
    """A mission that is advanced from step to step."""

    def __init__(self, *overrides: str) -> None:
        self.config = paper_scenario("ground={}", *overrides).config
        self.mission = OnlineMission(self.config)
        self.mission.hold(POSES)
        self.step = -1

    def fly(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.05)):
            self.step += 1
            self.mission.advance(self.step * PERIOD_NS)

    def leader(self) -> tuple[np.ndarray, np.ndarray, float]:
        found = self.mission.reference(np.array([self.step * PERIOD_NS])).leader
        return found.p_NB_N[0], found.v_NB_N[0], float(found.yaw_NB[0])

    def phase(self) -> str:
        return self.mission.reference(np.array([self.step * PERIOD_NS])).phase

    def rest(self) -> None:
        for _ in range(1200):
            self.fly(0.05)
            if self.mission.is_resting:  # in the next step
                self.fly(0.05)
                return
        raise AssertionError("the mission does not come to rest")


def test_it_forms_up_where_it_is_and_rests() -> None:
    flown = Flown()
    flown.fly(0.1)
    assert not flown.mission.is_resting
    flown.rest()
    place, velocity, yaw = flown.leader()
    assert place == pytest.approx(POSES.p_NB_N)
    assert velocity == pytest.approx(np.zeros(3))
    assert yaw == pytest.approx(0.4)
    assert flown.phase() == "(hover)"
    found = flown.mission.reference(np.array([flown.step * PERIOD_NS]))
    assert found.p_B1B2_C1[0, 0] == pytest.approx([-1.0, -0.5, -0.5])


def test_go_to_and_hover_on_the_way() -> None:
    flown = Flown()
    flown.rest()
    flown.mission.go_to(np.array([6.0, 3.0, 2.5]), math.nan)
    flown.fly(1.5)
    assert flown.phase() == "(go to)"
    before, velocity, yaw = flown.leader()
    assert np.linalg.norm(velocity) > 0.5
    assert yaw == pytest.approx(0.4)
    flown.mission.hover()
    flown.fly(0.05)
    after, _, _ = flown.leader()
    assert after - before == pytest.approx(velocity * 0.05, abs=0.01)
    flown.rest()
    stopped, still, _ = flown.leader()
    assert still == pytest.approx(np.zeros(3))
    assert np.linalg.norm(stopped - after) < 2.0
    flown.mission.go_to(np.array([6.0, 3.0, 2.5]), 1.0)
    flown.rest()
    place, _, yaw = flown.leader()
    assert place == pytest.approx([6.0, 3.0, 2.5])
    assert yaw == pytest.approx(1.0)


def test_the_phases_change_formation_and_end_in_a_hover() -> None:
    flown = Flown()
    flown.rest()
    begin = flown.step + 1
    flown.mission.start()
    seen = []
    while not seen or not flown.mission.is_resting:
        flown.fly(0.05)
        seen.append((flown.phase(), tuple(flown.mission.formation["follower_1"])))
    names = [name for name, _ in seen]
    starts = [step for step in range(1, len(names)) if names[step] != names[step - 1]]
    assert [names[0], *(names[step] for step in starts)] == ["A", "B", "C", "D", "E", "(hover)"]
    assert starts[:4] == [20, 120, 220, 300]
    assert seen[219][1] == (-1.0, -0.5, -0.5)
    assert seen[220][1] == (-1.0, -0.75, -0.5)
    assert flown.step > begin + 540


def test_a_start_does_not_plan_the_phases_in_flight(monkeypatch: pytest.MonkeyPatch) -> None:
    flown = Flown("phases.4.duration_s=3600")
    flown.fly(0.1)

    def too_slow(*_: object) -> None:
        raise AssertionError("the trajectory of an hour takes seconds")

    monkeypatch.setattr(LeaderTrajectory, "__init__", too_slow)
    flown.mission.start()
    flown.fly(1.0)
    assert flown.phase() == "A"


def test_a_trajectory_is_followed() -> None:
    flown = Flown()
    flown.rest()
    rows = np.array([[1.0, 1.0, -0.5, 1.8, 0.4], [4.0, 3.0, 0.0, 2.0, 0.4], [7.0, 5.0, 1.0, 2.0, 0.9]])
    flown.mission.follow_trajectory(rows)
    flown.fly(0.05)
    flown.fly(4.0)
    assert flown.phase() == "(trajectory)"
    assert flown.leader()[0] == pytest.approx([3.0, 0.0, 2.0])
    flown.rest()
    assert flown.leader()[0] == pytest.approx([5.0, 1.0, 2.0])


def test_a_formation_is_kept_through_other_requests() -> None:
    flown = Flown()
    flown.rest()
    flown.mission.set_formation(WIDE)
    flown.fly(0.05)
    assert not flown.mission.is_resting
    flown.mission.go_to(np.array([3.0, -0.5, 1.8]), math.nan)
    flown.rest()
    assert dict(flown.mission.formation) == WIDE


def test_a_team_that_is_to_land_brakes_and_descends() -> None:
    flown = Flown()
    flown.rest()
    flown.mission.go_to(np.array([9.0, -0.5, 1.8]), math.nan)
    flown.fly(2.0)
    before, velocity, _ = flown.leader()
    flown.mission.descend(0.6)
    flown.rest()
    place, still, yaw = flown.leader()
    assert still == pytest.approx(np.zeros(3))
    assert before[0] < place[0] < before[0] + velocity[0] ** 2
    assert (place[1], place[2], yaw) == pytest.approx((-0.5, 1.1, 0.4))  # followers 0.5 m below
    flown.mission.descend(2.0)
    flown.rest()
    assert flown.leader()[0][2] == pytest.approx(1.1)  # never up


def test_the_formation_that_was_just_asked_for_counts() -> None:
    flown = Flown()
    flown.rest()
    flown.mission.set_formation(WIDE | {"follower_2": (-1.0, 0.75, -1.2)})
    with pytest.raises(ConfigError, match=re.escape("'follower_2' would come to 0.10 m above the ground")):
        flown.mission.go_to(np.array([1.0, -0.5, 1.3]), math.nan)
    flown.mission.descend(0.6)
    flown.rest()
    assert flown.leader()[0][2] == pytest.approx(1.8)  # the follower is at 0.6 m


@pytest.mark.parametrize(
    ("place", "says"),
    [
        ((1.0, 0.0, 0.6), "'follower_1' would come to 0.10 m above the ground, at least 0.25 m are needed"),
        ((1.0, math.inf, 2.0), "go_to needs a finite place (got [1.0, inf, 2.0] m, nan rad)"),
        ((5.0, 2.0, 1.8), "'follower_1' would come within "),
        (
            (1e8, 2.0, 1.8),
            "go_to would take 74999999 s, at most 3600 s are allowed: go part",
        ),
    ],
)
def test_places_that_are_refused(place: tuple[float, float, float], says: str) -> None:
    flown = Flown(OBSTACLE)
    flown.rest()
    before = flown.leader()[0]
    with pytest.raises(ConfigError, match=re.escape(says)):
        flown.mission.go_to(np.array(place), math.nan)
    flown.fly(1.0)
    assert flown.leader()[0] == pytest.approx(before)


def test_a_formation_that_gets_to_the_ground_is_refused() -> None:
    flown = Flown()
    flown.rest()
    low = WIDE | {"follower_1": (-1.0, -0.75, -1.7)}
    with pytest.raises(ConfigError, match=re.escape("'follower_1' would come to 0.10 m above the ground")):
        flown.mission.set_formation(low)
    flown.rest()
    assert flown.mission.formation["follower_1"] == (-1.0, -0.5, -0.5)


def test_a_change_of_formation_through_an_obstacle_is_refused() -> None:
    """The ball is 0.5 m from both followers, in the middle between them."""
    x, y, z = POSES.p_NB_N + (-math.cos(0.4), -math.sin(0.4), -0.5)
    flown = Flown(f"obstacles=[{{kind: sphere, center_m: [{x}, {y}, {z}], radius_m: 0.2}}]")
    flown.rest()
    across = {"follower_1": (-1.0, 1.5, -0.5), "follower_2": (-2.0, 0.5, -0.5)}
    with pytest.raises(ConfigError, match=r"'follower_1' would come within 0\.\d+ m of an obstacle"):
        flown.mission.check_formation(across)
    flown.mission.check_formation({"follower_1": (-1.0, -1.5, -0.5), "follower_2": (-1.0, 1.5, -0.5)})


def test_a_phase_to_whose_formation_there_is_no_way_keeps_that_of_the_team() -> None:
    """The followers have changed sides before; places at the collision distance leave no room to go back."""
    narrow = "{follower_1: [-1.0, -0.25, -0.5], follower_2: [-1.0, 0.25, -0.5]}"
    swapped = {"follower_1": (-1.0, 0.5, -0.5), "follower_2": (-1.0, -0.5, -0.5)}
    flown = Flown(f"formations_m.wide={narrow}")
    flown.rest()
    flown.mission.start()
    flown.fly(1.0)
    flown.mission.set_formation(swapped)
    while flown.phase() != "E":
        flown.fly(0.05)
    assert flown.mission.formation == swapped
