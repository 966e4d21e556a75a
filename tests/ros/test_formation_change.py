"""Real nodes change a formation of five vehicles by parameters and by the service, in one flight."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

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


def to_msgs(formation: Mapping[str, Vector3]) -> list[RelativePosition]:
    return [
        RelativePosition(observer_id="leader", target_id=name, position=Vector3Msg(x=x, y=y, z=z))
        for name, (x, y, z) in formation.items()
    ]


NO_ROOM = VEE | {"follower_1": (-1.0, 0.25, -0.1), "follower_2": (-1.0, -0.25, -0.1)}
"""Two followers change sides, to places at the collision distance."""
REFUSED: dict[str, dict[str, Any]] = {
    "no way to this formation: 'follower_1' and 'follower_2' would come within": {
        "formation": to_msgs(NO_ROOM)
    },
    "set_formation needs exactly one of name, shape and formation (got name and shape)": {
        "name": "initial",
        "shape": "{kind: v, spacing_m: 1.2}",
    },
    "unknown formation 'wyde', known are initial": {"name": "wyde"},
    "shape: spacing_m: must be greater than 0 (got 0)": {"shape": "{kind: v, spacing_m: 0}"},
    "formation is impossible: 'leader' and 'follower_1' are 0.400 m apart": {
        "shape": "{kind: line, spacing_m: 0.4}"
    },
}
"""Requests by the begin of the reason for which they are refused."""


class ChangedFlight:
    """Refused requests, a line by parameters, the V by its name, and two followers change places."""

    def __init__(self, folder: Path) -> None:
        exchanged = VEE | {"follower_1": VEE["follower_2"], "follower_2": VEE["follower_1"]}
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
            self.refusals = {name: self._call(observer, **request) for name, request in REFUSED.items()}
            self.refused_parameters = client.set_at_once(parameters(NO_ROOM))
            self.line = client.set_at_once(parameters(LINE))
            self._fly(observer, ticks, 9.0)
            self.vee = self._call(observer, name="initial", assign=True)
            self._fly(observer, ticks, 9.0)
            self.exchanged = self._call(observer, formation=to_msgs(exchanged))
            self.ends = nodes.ends()
        self.log = read_flight_log(folder)
        self.recorded = read_recorded_flight(folder)

    @staticmethod
    def _fly(observer: Observer, ticks: list[StepDone], duration: float) -> None:
        asked = ticks[-1].step
        observer.until(lambda: ticks[-1].step > asked + 20 * duration)

    @staticmethod
    def _call(observer: Observer, **request: Any) -> SetFormation.Response:
        asked = SetFormation.Request(**request)
        response: SetFormation.Response = observer.call(SetFormation, "/formation/set_formation", asked)
        return response


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> ChangedFlight:
    return ChangedFlight(tmp_path_factory.mktemp("formation_change"))


def test_requests_are_refused_with_a_reason(flown: ChangedFlight) -> None:
    for reason, answer in flown.refusals.items():
        assert not answer.success
        assert answer.message.startswith(reason)
        assert "\n" not in answer.message
    assert flown.refused_parameters == flown.refusals[next(iter(REFUSED))].message


def test_accepted_requests_are_answered(flown: ChangedFlight) -> None:
    assert flown.line == ""
    assert flown.vee.success
    assert flown.exchanged.success
    assert re.fullmatch(r"applies from step \d+ on, takes 5\.\d s; follower_1 to .*", flown.vee.message)
    assert re.fullmatch(
        r"applies from step \d+ on, takes \d\.\d s, vehicles fly around each other", flown.exchanged.message
    )


def test_changes_of_several_metres_are_flown(flown: ChangedFlight) -> None:
    assert {code for code, _ in flown.ends.values()} == {0}
    errors = formation_errors(flown.log, scored_pairs(SCENARIO.config.team)).mean(axis=1)
    changes = np.flatnonzero(np.diff(errors) > 0.5) + 1  # the target moved, the vehicles did not yet
    assert len(changes) == 3
    for first, end in zip(changes, (*changes[1:], len(errors)), strict=True):
        assert errors[first + 20 * 8 : end].max() < 0.25
    assert separation_min(flown.log.p_NB_N) > 0.6


def test_a_replay_finds_every_command_again(flown: ChangedFlight) -> None:
    assert replay(flown.recorded, flown.recorded.scenario).identical
