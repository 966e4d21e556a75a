"""Real nodes, a team on the ground, and a pilot who takes it off, flies it and lands it by services."""

from pathlib import Path
from typing import Any

import domain_coordinator
import numpy as np
import pytest
from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Point, Quaternion, Transform, Vector3
from std_srvs.srv import Trigger
from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

from relform_analysis.flight.from_bag import read_flight_log
from relform_analysis.replay.from_bag import read_recorded_flight
from relform_analysis.replay.replay import replay
from relform_core.flight_modes import TeamMode
from relform_core.names import RECORDER_NODE
from relform_msgs.msg import TeamStatus
from relform_msgs.srv import GoTo
from support.nodes import Nodes
from support.observer import Observer
from support.scenarios import paper_scenario

SCENARIO = paper_scenario("controller=team", "ground={waits: true, time_s: 90}", "start.yaw_deg=25", seed=3)


class Pilot:
    """Asks for one thing after the other, and waits until it is done."""

    def __init__(self, observer: Observer) -> None:
        self._observer = observer
        self.statuses: list[TeamStatus] = observer.collect(TeamStatus, "/formation/status")
        topic = "/formation/trajectory"
        self._trajectories = observer.node.create_publisher(MultiDOFJointTrajectory, topic, 1)

    def ask(self, name: str) -> tuple[bool, str]:
        answer = self._observer.call(Trigger, f"/formation/controller/{name}", Trigger.Request())
        return answer.success, answer.message

    def go_to(self, x: float, y: float, z: float, **fields: Any) -> tuple[bool, str]:
        request = GoTo.Request(position=Point(x=x, y=y, z=z), **fields)
        answer = self._observer.call(GoTo, "/formation/go_to", request)
        return answer.success, answer.message

    def follow(self, frame: str, *rows: tuple[float, float, float, float]) -> None:
        trajectory = MultiDOFJointTrajectory()
        trajectory.header.frame_id = frame
        for time, x, y, z in rows:
            transform = Transform(translation=Vector3(x=x, y=y, z=z), rotation=Quaternion(w=0.0))
            trajectory.points.append(
                MultiDOFJointTrajectoryPoint(transforms=[transform], time_from_start=Duration(sec=int(time)))
            )
        self._observer.until(lambda: self._trajectories.get_subscription_count() > 0)
        self._trajectories.publish(trajectory)

    def wait(self, mode: TeamMode) -> None:
        self._observer.until(lambda: bool(self.statuses) and self.statuses[-1].mode == mode, 120.0)

    def wait_for_refusal(self) -> str:
        self._observer.until(lambda: bool(self.statuses[-1].refused))
        return str(self.statuses[-1].refused)


class Flown:
    """A flight by hand, and what was answered."""

    def __init__(self, folder: Path) -> None:
        with (
            domain_coordinator.domain_id() as domain,
            Observer.running(domain) as observer,
            Nodes(SCENARIO, folder, domain, observers=[RECORDER_NODE]) as nodes,
        ):
            pilot = Pilot(observer)
            for name in (*SCENARIO.config.team.vehicles, "controller"):
                nodes.start(name)
            nodes.start("recorder", f"output:={folder / 'bag'}")
            nodes.start("clock")
            pilot.wait(TeamMode.IDLE)
            self.too_early = pilot.ask("land")
            self.taken_off = pilot.ask("take_off")
            pilot.wait(TeamMode.TAKING_OFF)
            self.twice = pilot.ask("take_off")
            pilot.wait(TeamMode.HOVERING)
            self.foreign = pilot.go_to(2.0, 1.0, 2.5, frame_id="odom")
            self.low = pilot.go_to(2.0, 1.0, 0.4)
            self.gone = pilot.go_to(2.0, 1.0, 2.5, turn=True, yaw=1.0)
            pilot.wait(TeamMode.FLYING)
            pilot.wait(TeamMode.HOVERING)
            pilot.follow("map", (1.0, 9.0, 9.0, 2.5), (2.0, 9.0, 9.0, 2.5))
            self.far = pilot.wait_for_refusal()
            pilot.follow("map", (1.0, 2.1, 1.0, 2.5), (4.0, 4.0, 1.5, 2.0), (7.0, 5.0, 3.0, 2.0))
            pilot.wait(TeamMode.FLYING)
            pilot.wait(TeamMode.HOVERING)
            self.landed = pilot.ask("land")
            pilot.wait(TeamMode.LANDING)
            pilot.wait(TeamMode.IDLE)
            self.ends = nodes.ends()
            self.modes = [TeamMode(status.mode) for status in pilot.statuses]
        self.folder = folder


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    return Flown(tmp_path_factory.mktemp("requests"))


def test_requests_are_answered(flown: Flown) -> None:
    for success, message in (flown.taken_off, flown.gone, flown.landed):
        assert success
        assert message.startswith("applies from step ")


def test_refusals_give_their_reason(flown: Flown) -> None:
    assert flown.too_early == (False, "land is refused: the team is idle, expected hovering or flying")
    assert flown.twice == (False, "take_off is refused: the team is taking off, expected idle")
    assert flown.foreign == (False, "frame_id must be 'map' (got 'odom')")
    assert flown.low[1].endswith("m above the ground, at least 0.25 m are needed")
    assert flown.far.startswith("trajectory begins ")


def test_the_flight_is_recorded_scored_and_replayed(flown: Flown) -> None:
    assert {code for code, _ in flown.ends.values()} == {0}
    log = read_flight_log(flown.folder)
    leader = log.p_NB_N[:, log.leader]
    assert np.linalg.norm(leader - [2.0, 1.0, 2.5], axis=1).min() < 0.1
    assert np.linalg.norm(leader - [5.0, 3.0, 2.0], axis=1).min() < 0.1
    assert log.p_NB_N[-1, :, 2].max() < 0.2
    assert [entry.description for entry in log.changes if "team" not in entry.source]
    recorded = read_recorded_flight(flown.folder)
    assert replay(recorded, recorded.scenario).identical
