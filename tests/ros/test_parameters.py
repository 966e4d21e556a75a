"""Parameters of real nodes: given at the start, changed in flight, recorded, replayed."""

import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import domain_coordinator
import pytest
import yaml
from rcl_interfaces.msg import ParameterType
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock

from relform_analysis.replay.from_bag import read_recorded_flight
from relform_analysis.replay.replay import replay
from relform_bags.reader import BagMessage, find_bag, read_bag
from relform_core.names import CONTROLLER_NODE, EVENTS, RECORDER_NODE, REFERENCE, vehicle_node
from relform_msgs.msg import FormationEvent, FormationReference, FormationState, StepDone
from relform_ros.qos import LATCHED
from support.nodes import HOVER, Nodes, short
from support.observer import Observer
from support.parameter_client import ParameterClient
from support.scenarios import paper_scenario

VEHICLES = ("leader", "follower_1", "follower_2")
FOLLOWER = vehicle_node("follower_1")
TWO_PHASES = "phases=[{{{}, formation: initial, {}}}, {{{}, formation: wide, {}}}]".format(
    "name: A, title: narrow, duration_s: 6.0, steady_from_s: 0.0",
    f"motion: {HOVER}",
    "name: B, title: wide, duration_s: 3.0, steady_from_s: 0.0",
    f"motion: {HOVER}",
)
FORMATION = "formation.follower_1"
WEIGHT = "weights.formation_per_m2"


class ChangedFlight:
    """A recorded flight of two phases in which parameters are changed, with all answers and messages."""

    def __init__(self, folder: Path) -> None:
        self.scenario = paper_scenario(TWO_PHASES, seed=2)
        with domain_coordinator.domain_id() as domain, Observer.running(domain) as observer:
            self.references = observer.collect(FormationReference, REFERENCE)
            with Nodes(self.scenario, folder, domain, observers=[RECORDER_NODE]) as nodes:
                self._fly(observer, nodes, folder)
                self.ends = nodes.ends()
        self.recorded = read_recorded_flight(folder)
        self.events = recorded_events(folder)

    def _fly(self, observer: Observer, nodes: Nodes, folder: Path) -> None:
        ticks = observer.collect(StepDone, f"{vehicle_node('leader')}/step_done", LATCHED)
        controller, follower = ParameterClient(observer, CONTROLLER_NODE), ParameterClient(observer, FOLLOWER)
        for name in VEHICLES:
            nodes.start(name)
        nodes.start("controller", "weights.torque_per_n2_m2:=12")  # an integer, as people write it
        nodes.start("recorder", f"output:={folder / 'bag'}")
        self.described = controller.describe(WEIGHT, FORMATION, "scenario", "observers")
        self.described += follower.describe("tilt_max_deg", "failsafe.plan_max_s")
        self.at_start = controller.get(WEIGHT, FORMATION, "weights.torque_per_n2_m2")
        clock = nodes.start("clock")
        observer.until(lambda: bool(ticks) and ticks[-1].step > 20)
        clock.send_signal(signal.SIGSTOP)  # the others wait for its tick, and still answer

        names = (WEIGHT, FORMATION, "weights.terminal_scale")
        before = controller.get(*names)
        place = [-1.25, -0.75, 0.25]
        self.refusal = controller.set_at_once({FORMATION: place, "weights.terminal_scale": 3.0, WEIGHT: 0.0})
        self.refusals = controller.set({WEIGHT: -2.0, FORMATION: [-1.0, 0.5, -0.4], "scenario": "x"})
        self.refusals += follower.set(
            {"tilt_max_deg": 181.0, "observers": ["/x"], "failsafe.plan_max_s": "x", "tilt_max": 1.0}
        )
        self.untouched = controller.get(*names) == before
        self.accepted = [
            controller.set_at_once({WEIGHT: 30.0, FORMATION: place, "weights.terminal_scale": 5})
        ]
        self.accepted += follower.set({"tilt_max_deg": 70.0})
        self.in_phase_a = controller.get(*names)

        clock.send_signal(signal.SIGCONT)
        observer.until(lambda: ticks[-1].step > 60)  # in flight, at a random step
        self.accepted += controller.set({"weights.leader_yaw_per_rad2": 4.0, WEIGHT: 8.0})
        observer.until(lambda: bool(self.references) and self.references[-1].phase == "B")
        self.in_phase_b = controller.get(*names)


def recorded_events(folder: Path) -> list[FormationEvent]:
    """All events but those of computed steps."""
    events = [
        deserialize_message(entry.data, FormationEvent)
        for entry in read_bag(find_bag(folder))
        if isinstance(entry, BagMessage) and entry.topic == EVENTS
    ]
    return [event for event in events if event.kind != FormationEvent.STEP]


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> ChangedFlight:
    return ChangedFlight(tmp_path_factory.mktemp("changed"))


def test_parameters_have_types_bounds_and_descriptions(flown: ChangedFlight) -> None:
    weight, formation, _, _, tilt, plan = flown.described
    assert weight.type == plan.type == ParameterType.PARAMETER_DOUBLE
    assert formation.type == ParameterType.PARAMETER_DOUBLE_ARRAY
    assert [each.read_only for each in flown.described] == [False, False, True, True, False, False]
    assert all(each.description for each in flown.described)
    (bounds,) = tilt.floating_point_range
    assert (bounds.from_value, bounds.to_value) == (0.0, 180.0)
    assert weight.additional_constraints == "greater than 0"


def changed_by(event: FormationEvent) -> dict[str, float]:
    """The changed parameters of an event."""
    return dict(zip(event.parameter_names, event.parameter_values, strict=True))


def test_values_given_at_the_start_apply_from_the_first_step(flown: ChangedFlight) -> None:
    assert flown.at_start == [10.0, [-1.0, -0.5, -0.5], 12.0]
    first = flown.events[0]
    assert (first.step, first.source) == (0, CONTROLLER_NODE)
    assert changed_by(first) == {"weights.torque_per_n2_m2": 12.0}


def test_refusals_name_key_value_and_bound(flown: ChangedFlight) -> None:
    assert flown.refusal == f"{WEIGHT}: must be greater than 0 (got 0.0)"
    negative, near, read_only, tilt, observers, text, unknown = flown.refusals
    for part in (WEIGHT, "-2.0", "Min: 0.0"):
        assert part in negative
    assert near.startswith("formation is impossible: 'follower_1' and 'follower_2' are 0.100 m apart")
    assert "read-only" in read_only
    assert "scenario" in read_only
    for part in ("tilt_max_deg", "181.0", "Max: 180.0"):
        assert part in tilt
    assert "observers" in observers
    assert "DOUBLE" in text
    assert "tilt_max'" in unknown


def test_a_change_with_one_bad_value_is_refused_as_a_whole(flown: ChangedFlight) -> None:
    assert flown.untouched
    assert all(event.step > 20 for event in flown.events[1:])


def test_a_change_is_an_event_of_the_first_step_it_applies_to(flown: ChangedFlight) -> None:
    assert set(flown.accepted) == {""}
    changes = [
        (event.source, changed_by(event), [place.target_id for place in event.formation])
        for event in flown.events[1:]
    ]
    both = list(VEHICLES[1:])
    at_once = flown.events[1:4]
    assert sorted(changes[:3], key=str) == [
        (CONTROLLER_NODE, {WEIGHT: 30.0, "weights.terminal_scale": 5.0}, []),
        (CONTROLLER_NODE, {}, both),
        ("follower_1", {"tilt_max_deg": 70.0}, []),
    ]
    (step,) = {event.step for event in at_once if event.source == CONTROLLER_NODE}
    assert 20 < step < 60
    later: dict[str, float] = {}
    for _, values, _ in changes[3:]:  # together, or a step apart
        later |= values
    assert later == {"weights.leader_yaw_per_rad2": 4.0, WEIGHT: 8.0}
    for reference in flown.references:
        if reference.phase == "A":
            expected = (-1.0, -0.5, -0.5) if reference.step < step else (-1.25, -0.75, 0.25)
            place = reference.formation[0].position
            assert (place.x, place.y, place.z) == expected, reference.step


def test_the_next_phase_sets_the_formation_of_the_scenario(flown: ChangedFlight) -> None:
    assert flown.in_phase_a == [30.0, [-1.25, -0.75, 0.25], 5.0]
    assert flown.in_phase_b == [8.0, [-1.0, -0.75, -0.5], 5.0]


def test_no_node_prints_an_error(flown: ChangedFlight) -> None:
    assert set(flown.ends.values()) == {(0, "")}


def test_a_replay_with_the_changes_gives_every_command_again(flown: ChangedFlight) -> None:
    assert len(flown.recorded.steps) == flown.scenario.config.n_steps
    assert replay(flown.recorded, flown.recorded.scenario).identical


def test_a_replay_without_one_of_the_changes_does_not(flown: ChangedFlight) -> None:
    steps = [
        replace(step, parameters={}) if step.measurements.step else step for step in flown.recorded.steps
    ]
    changed = replay(replace(flown.recorded, steps=tuple(steps)), flown.recorded.scenario)
    assert changed.first_difference == min(
        event.step for event in flown.events[1:] if event.kind == FormationEvent.SET_FORMATION
    )


def test_parameters_dumped_from_a_node_can_be_given_to_it(tmp_path: Path) -> None:
    """As ``ros2 param dump`` writes them: every parameter, under the full name of the node."""
    scenario = paper_scenario(short(600.0))
    values: list[dict[str, Any]] = []
    given = ["-p", "formation.follower_2:=[-1.0, 0.5, 1.0]", "-p", f"{WEIGHT}:=3.25"]
    for _ in range(2):
        with (
            domain_coordinator.domain_id() as domain,
            Observer.running(domain) as observer,
            Nodes(scenario, tmp_path, domain) as nodes,
        ):
            nodes.start("controller", arguments=given)
            values.append(ParameterClient(observer, CONTROLLER_NODE).dump())
        file = tmp_path / "dump.yaml"
        file.write_text(yaml.dump({CONTROLLER_NODE: {"ros__parameters": values[-1]}}))
        given = ["--params-file", str(file)]
    assert values[0] == values[1]
    assert values[0][WEIGHT] == 3.25
    assert values[0]["formation.follower_2"] == [-1.0, 0.5, 1.0]


@pytest.mark.parametrize(
    ("name", "arguments", "error"),
    [
        (
            "controller",
            ["-p", f"{WEIGHT}:=heavy"],
            f"parameter {WEIGHT} must be of type DOUBLE, as in 1.0 (got 'heavy', STRING)",
        ),
        ("controller", ["-p", f"{WEIGHT}:=-1"], f"parameter {WEIGHT} must be between 0 and 1e+06 (got -1.0)"),
        (
            "leader",
            ["-p", "failsafe.descent_speed_m_s:=0"],
            "failsafe.descent_speed_m_s: must be greater than 0",
        ),
        (
            "clock",
            ["-p", "start_timeout_s:=0"],
            "parameter start_timeout_s must be between 0.1 and 3600 (got 0",
        ),
        (
            "clock",
            ["-r", "__node:=watch"],
            "unknown node name /sim/watch, expected one of /sim/clock: start the node without -r __node:=",
        ),
    ],
    ids=["type", "bound", "exclusive", "read-only", "name"],
)
def test_an_unusable_parameter_is_one_line(
    name: str, arguments: list[str], error: str, tmp_path: Path
) -> None:
    with domain_coordinator.domain_id() as domain, Nodes(paper_scenario(), tmp_path, domain) as nodes:
        nodes.start(name, arguments=arguments)
        code, errors = nodes.end(name)
    (line,) = errors.splitlines()
    assert code == 1
    assert f": {error}" in line


def test_one_file_for_all_nodes_with_remapped_topics_and_an_unknown_parameter(
    tmp_path: Path,
) -> None:
    file = tmp_path / "nodes.yaml"
    own = {WEIGHT: 11, "weights.formation": 3.0, "use_sim_time": True}
    file.write_text(
        yaml.dump(
            {
                "/**": {"ros__parameters": {"failsafe": {"plan_max_s": 0.5}, "use_sim_time": True}},
                CONTROLLER_NODE: {"ros__parameters": own},
                "/*/quadrotor": {"ros__parameters": {"tilt_max_deg": 80.0}},
            }
        )
    )
    with (
        domain_coordinator.domain_id() as domain,
        Observer.running(domain) as observer,
        Nodes(paper_scenario(short(2.0)), tmp_path, domain) as nodes,
    ):
        given = ["--params-file", str(file), "-r", "/clock:=/sim/time", "-r", "/formation/state:=/team/state"]
        clocks = observer.collect(Clock, "/sim/time")
        states = observer.collect(FormationState, "/team/state")
        for name in (*VEHICLES, "controller"):
            nodes.start(name, arguments=given)
        assert ParameterClient(observer, FOLLOWER).get("tilt_max_deg", "failsafe.plan_max_s") == [80.0, 0.5]
        assert ParameterClient(observer, CONTROLLER_NODE).get(WEIGHT) == [11.0]
        nodes.start("clock", arguments=given)
        ends = nodes.ends()
        observer.until(lambda: bool(clocks) and bool(states))
    warning = "/formation/controller: warning: unknown parameter"
    assert ends.pop("controller") == (
        0,
        f"{warning} failsafe.plan_max_s is ignored\n"
        f"{warning} weights.formation is ignored (did you mean '{WEIGHT}'?)\n",
    )
    (clock_warning,) = ends.pop("clock")[1].splitlines()
    assert clock_warning == "/sim/clock: warning: unknown parameter failsafe.plan_max_s is ignored"
    assert set(ends.values()) == {(0, "")}


def test_a_node_with_another_configuration_is_named_and_can_be_restarted(tmp_path: Path) -> None:
    scenario, other = (paper_scenario(short(2.0), seed=seed) for seed in (1, 2))
    (tmp_path / "other").mkdir()
    with (
        domain_coordinator.domain_id() as domain,
        Nodes(scenario, tmp_path, domain) as nodes,
        Nodes(other, tmp_path / "other", domain) as others,
    ):
        for name in ("leader", "follower_1", "controller", "clock"):
            nodes.start(name)
        others.start("follower_2")
        code, errors = nodes.end("clock")
        others.processes["follower_2"].send_signal(signal.SIGINT)
        others.end("follower_2")
        for name in ("follower_2", "clock"):
            nodes.start(name)
        assert {name: nodes.end(name)[0] for name in nodes.processes} == dict.fromkeys(nodes.processes, 0)
    assert code == 1
    assert errors == (
        "/sim/clock: /follower_2/quadrotor flies another configuration "
        f"({other.fingerprint} instead of {scenario.fingerprint}): "
        "start all nodes with the same scenario file and observers\n"
    )
