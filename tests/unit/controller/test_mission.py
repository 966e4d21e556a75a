"""Missions: the phases of a scenario, and another one in their place that never ends."""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from relform_controller.formation_controller import Decision, FormationController
from relform_controller.ocp.layout import ordered_pairs
from relform_controller.reference.mission import Mission, MissionReference, ScenarioMission
from relform_controller.reference.trajectory import LeaderReference
from relform_core.arrays import Array, Integers
from relform_core.blend import Blend
from relform_core.errors import ConfigError
from relform_core.measurements import RotorCommand, TeamMeasurements
from relform_core.schema import Vector3
from relform_sim.vehicle import Vehicle
from support.flights import AGILE, all_speeds, record, replay
from support.scenarios import NOISE_FREE, paper_scenario

REPOSITORY = Path(__file__).parents[3]
PERIOD_NS = 50_000_000
FORMATION: dict[str, Vector3] = {"follower_1": (-1.0, -0.5, -0.5), "follower_2": (-1.0, 0.5, -0.5)}
NEW: dict[str, Vector3] = {"follower_1": (-1.0, -0.5, -0.25), "follower_2": (-1.0, 0.5, -0.5)}
SHORT = (
    "phases=[{name: A, title: still, duration_s: 0.5, steady_from_s: 0, formation: initial, "
    "motion: {kind: hover, ramp_s: 0}}]"
)


class HoverForEver:
    """Stay at one place in one formation, without an end."""

    formation: Mapping[str, Vector3] = FORMATION

    def __init__(self, place: Vector3) -> None:
        self._place = np.array(place)

    def way_to(self, formation: Mapping[str, Vector3]) -> Blend:
        return Blend.at_rest(np.array([(0.0, 0.0, 0.0), *FORMATION.values()]))

    def check_formation(self, formation: Mapping[str, Vector3]) -> None:
        raise ConfigError("this mission keeps its formation")

    def set_formation(self, formation: Mapping[str, Vector3]) -> None:
        self.check_formation(formation)

    def advance(self, stamp_ns: int) -> None:
        pass

    def reference(self, stamps_ns: Integers) -> MissionReference:
        n = len(stamps_ns)
        places = np.array([(0.0, 0.0, 0.0), *FORMATION.values()])
        pairs = np.array([places[j] - places[i] for i, j in ordered_pairs(len(places))])
        leader = LeaderReference(np.tile(self._place, (n, 1)), np.zeros((n, 3)), np.zeros(n))
        return MissionReference("hover", leader, np.repeat(pairs[:, None], n, axis=1), pairs)


def fly(mission: Mission, n_steps: int) -> tuple[list[Decision], list[np.ndarray]]:
    """Decisions, and the true position of the leader, in a scenario of 10 control steps."""
    scenario = paper_scenario(SHORT, *NOISE_FREE)
    config = scenario.config
    vehicles = {name: Vehicle(config, scenario.seed, name) for name in config.team.vehicles}
    controller = FormationController(config, mission=mission)
    commands: Mapping[str, RotorCommand | None] = dict.fromkeys(vehicles)
    decisions, places = [], []
    for step in range(n_steps):
        truth = {name: vehicle.advance(step, commands[name]) for name, vehicle in vehicles.items()}
        measured = {name: vehicle.measure(step, truth) for name, vehicle in vehicles.items()}
        decisions.append(controller.step(TeamMeasurements(step, step * PERIOD_NS, measured)))
        commands = decisions[-1].commands
        places.append(truth["leader"].p_NB_N)
    return decisions, places


def test_another_mission_is_flown_past_the_end_of_the_scenario() -> None:
    decisions, places = fly(HoverForEver((0.3, -0.2, 2.25)), n_steps=100)
    np.testing.assert_allclose(places[0], [0.0, 0.0, 2.0])
    np.testing.assert_allclose(places[-1], [0.3, -0.2, 2.25], atol=0.01)
    assert {decision.reference.phase for decision in decisions} == {"hover"}
    for pair in decisions[-1].state.pairs:
        np.testing.assert_allclose(pair.p_B1B2_C1__est, pair.p_B1B2_C1__ref, atol=0.01)


def test_a_mission_decides_about_requests() -> None:
    controller = FormationController(paper_scenario().config, mission=HoverForEver((0.0, 0.0, 2.0)))
    with pytest.raises(ConfigError, match=r"^this mission keeps its formation$"):
        controller.set_formation(NEW)
    assert controller.formation == FORMATION


def test_the_mission_of_the_scenario_is_the_default() -> None:
    scenario = paper_scenario(AGILE, seed=4)
    measured, decided = record(scenario, 30)
    controller = FormationController(scenario.config, mission=ScenarioMission(scenario.config))
    np.testing.assert_array_equal(all_speeds(replay(controller, measured)), all_speeds(decided))


def test_the_phases_of_a_scenario() -> None:
    config = paper_scenario().config
    mission = ScenarioMission(config)
    for step, phase, width in ((0, "A", 0.5), (219, "C", 0.5), (220, "D", 0.75), (539, "E", 0.75)):
        mission.advance(step * PERIOD_NS)
        reference = mission.reference(np.arange(step, step + 16) * PERIOD_NS)
        assert reference.phase == phase
        assert reference.leader.p_NB_N.shape == (16, 3)
        np.testing.assert_allclose(reference.p_B1B2_C1[0], np.tile([-1.0, -width, -0.5], (16, 1)))
        np.testing.assert_allclose(reference.p_B1B2_C1__target[0], [-1.0, -width, -0.5])
        assert mission.formation["follower_1"] == (-1.0, -width, -0.5)


def test_a_request_below_the_ground_is_refused() -> None:
    """The leader flies at 2 m until it climbs in phase E; phase D changes the formation."""
    mission = ScenarioMission(paper_scenario().config)
    mission.advance(0)
    low: dict[str, Vector3] = {"follower_1": (-3.0, -3.0, -4.0), "follower_2": (-1.0, 0.5, -0.5)}
    with pytest.raises(ConfigError) as error:
        mission.set_formation(low)
    assert str(error.value) == (
        "formation puts 'follower_1' at -2.000 m above ground, more than 0 m are needed: "
        "the leader flies as low as 2.000 m"
    )
    mission.advance(PERIOD_NS)
    assert mission.formation == FORMATION
    mission.check_formation(FORMATION)  # the present formation needs no way
    mission.advance(530 * PERIOD_NS)
    mission.set_formation(low)
    mission.advance(531 * PERIOD_NS)
    assert mission.formation == low


def documented_places() -> list[tuple[str, Vector3]]:
    """Follower and place of every request in the documentation."""
    pattern = re.compile(r'formation\.(follower_\d) "\[([^]]*)\]"')
    found = []
    for page in (REPOSITORY / "README.md", REPOSITORY / "docs/nodes.md"):
        for follower, numbers in pattern.findall(page.read_text()):
            x, y, z = map(float, numbers.split(","))
            found.append((follower, (x, y, z)))
    assert found
    return found


@pytest.mark.parametrize(("follower", "place"), documented_places())
def test_documented_request_is_accepted_at_any_step(follower: str, place: Vector3) -> None:
    config = paper_scenario().config
    mission = ScenarioMission(config)
    for step in range(config.n_steps):
        mission.advance(step * config.period_ns)
        mission.check_formation({**mission.formation, follower: place})


def test_a_request_in_flight() -> None:
    mission = ScenarioMission(paper_scenario().config)
    mission.advance(0)
    mission.set_formation(NEW)
    assert mission.formation == FORMATION
    mission.advance(PERIOD_NS)
    assert mission.formation == NEW
    with pytest.raises(ConfigError, match=r"^formation has no position for 'follower_2'$"):
        mission.set_formation({"follower_1": (-1.5, -0.75, 0.25)})


def test_a_leader_reference_of_ones_own_replaces_the_motions() -> None:
    """It sinks from 2 m at 0.5 m/s along y: at 0.3 s it is at 1.85 m, and at 1 s, the end, at 1.5 m."""

    def sinking(elapsed: Array) -> LeaderReference:
        v_NB_N = np.tile([0.0, 0.7, -0.5], (len(elapsed), 1))
        return LeaderReference([1.0, -3.0, 2.0] + elapsed[:, None] * v_NB_N, v_NB_N, 0.4 + 0.2 * elapsed)

    config = paper_scenario(SHORT, "phases.0.duration_s=1.0").config
    mission = ScenarioMission(config, leader=sinking)
    mission.advance(0)
    found = mission.reference(np.array([300_000_000, 500_000_000]))
    np.testing.assert_allclose(found.leader.p_NB_N, [[1.0, -2.79, 1.85], [1.0, -2.65, 1.75]])
    np.testing.assert_allclose(found.leader.yaw_NB, [0.46, 0.5])
    assert found.phase == "A"
    low: dict[str, Vector3] = {"follower_1": (-2.0, -1.0, -1.6), "follower_2": (-2.0, 1.0, -0.5)}
    with pytest.raises(ConfigError, match=r"at -0\.100 m above ground.*flies as low as 1\.500 m"):
        mission.set_formation(low)
