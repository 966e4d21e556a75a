"""Real nodes change a formation of five vehicles by parameters and by the service, in one flight."""

from collections.abc import Mapping
from pathlib import Path

import domain_coordinator
import numpy as np
import pytest
from geometry_msgs.msg import Vector3 as Vector3Msg

from relform_analysis.flight.from_bag import read_flight_log
from relform_analysis.flight.metrics import separation_min
from relform_analysis.flight.tracking_errors import formation_errors, scored_pairs
from relform_analysis.replay.from_bag import read_recorded_flight
from relform_analysis.replay.replay import replay
from relform_core.names import CONTROLLER_NODE, RECORDER_NODE, vehicle_node
from relform_core.schema import Vector3
from relform_msgs.msg import RelativePosition, StepDone
from relform_msgs.srv import SetFormation
from relform_ros.qos import LATCHED
from support.formations import as_yaml, line_astern, vee
from support.nodes import Nodes, short
from support.observer import Observer
from support.parameter_client import ParameterClient
from support.scenarios import paper_scenario

N_VEHICLES = 5
VEE, LINE = vee(N_VEHICLES), line_astern(N_VEHICLES)
SCENARIO = paper_scenario(
    f"team.followers=[{', '.join(VEE)}]",
    f"formations_m={{initial: {as_yaml(VEE)}}}",
    "start.position_m=[0, 0, 5]",
    short(30.0),
    seed=1,
)


def parameters(formation: Mapping[str, Vector3]) -> dict[str, list[float]]:
    return {f"formation.{name}": list(place) for name, place in formation.items()}


class ChangedFlight:
    """V, line by parameters, V by the service; a change of sides without room is refused by both."""

    def __init__(self, folder: Path) -> None:
        no_room = VEE | {"follower_1": (-1.0, 0.25, -0.1), "follower_2": (-1.0, -0.25, -0.1)}
        with (
            domain_coordinator.domain_id() as domain,
            Observer.running(domain) as observer,
            Nodes(SCENARIO, folder, domain, observers=[RECORDER_NODE]) as nodes,
        ):
            ticks = observer.collect(StepDone, f"{vehicle_node('leader')}/step_done", LATCHED)
            for name in (*SCENARIO.config.team.vehicles, "controller"):
                nodes.start(name)
            nodes.start("recorder", f"output:={folder / 'bag'}")
            client = ParameterClient(observer, CONTROLLER_NODE)
            nodes.start("clock")
            observer.until(lambda: bool(ticks) and ticks[-1].step > 10)
            self.refusals = [client.set_at_once(parameters(no_room))]
            self.refusals.append(self._call(observer, no_room).message)
            self.line = client.set_at_once(parameters(LINE))
            asked = ticks[-1].step
            observer.until(lambda: ticks[-1].step > asked + 20 * 9)
            self.vee = self._call(observer, VEE)
            self.ends = {name: nodes.end(name) for name in nodes.processes}
        self.log = read_flight_log(folder)
        self.recorded = read_recorded_flight(folder)

    @staticmethod
    def _call(observer: Observer, formation: Mapping[str, Vector3]) -> SetFormation.Response:
        request = SetFormation.Request(
            formation=[
                RelativePosition(observer_id="leader", target_id=name, position=Vector3Msg(x=x, y=y, z=z))
                for name, (x, y, z) in formation.items()
            ]
        )
        response: SetFormation.Response = observer.call(SetFormation, "/formation/set_formation", request)
        return response


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> ChangedFlight:
    return ChangedFlight(tmp_path_factory.mktemp("formation_change"))


def test_a_change_without_room_is_refused_with_its_reason(flown: ChangedFlight) -> None:
    problem = "'follower_1' and 'follower_2' would come within"
    for refusal in flown.refusals:
        assert refusal.startswith(f"no way to this formation: {problem}")
        assert refusal.endswith("at least 0.500 m are needed; change it in two steps")


def test_changes_of_several_metres_are_flown(flown: ChangedFlight) -> None:
    assert (flown.line, flown.vee.success) == ("", True)
    assert {code for code, _ in flown.ends.values()} == {0}
    errors = formation_errors(flown.log, scored_pairs(SCENARIO.config.team)).mean(axis=1)
    changes = np.flatnonzero(np.diff(errors) > 1.0) + 1  # the target moved, the vehicles did not yet
    assert len(changes) == 2
    for first, end in zip(changes, (changes[1], len(errors)), strict=True):
        assert errors[first + 20 * 8 : end].max() < 0.25
    assert separation_min(flown.log.p_NB_N) > 0.9


def test_a_replay_finds_every_command_again(flown: ChangedFlight) -> None:
    assert replay(flown.recorded, flown.recorded.scenario).identical
