"""Contradictions, bad overrides and files without configuration give one line each."""

from pathlib import Path
from typing import Annotated

import pytest
from pydantic import Field, ValidationError

from relform_core.errors import ConfigError
from relform_core.explain import Origins, explain
from relform_core.load import load_scenario
from relform_core.schema import Schema
from relform_core.sensors import registry
from support.scenarios import CONFIG_FOLDER, FROM_GROUND, PAPER

VEHICLE = CONFIG_FOLDER / "vehicles/hummingbird.yaml"
SENSORS = CONFIG_FOLDER / "sensors/paper.yaml"
CONTROLLER = CONFIG_FOLDER / "controller/retuned.yaml"
EVENT = "start_s: 1, end_s: 2, target: leader"
MOTIONS = "'hover', 'straight', 'turn', 'spiral', 'circle', 'figure_eight', 'waypoints', 'path'"


def problem_of(override: str) -> str:
    """The one line of the error that an override of the paper's scenario gives."""
    with pytest.raises(ConfigError) as caught:
        load_scenario(PAPER, [override])
    (line,) = str(caught.value).splitlines()
    return line


VIEW = (
    "axis_azimuth_deg: 0, axis_elevation_deg: 0, half_angle_deg: 40, range_max_m: 5, price_per_unit: 1, "
    "square_price_per_unit2: 1"
)


@pytest.mark.parametrize(
    ("override", "problem"),
    [
        (
            "geofence={x_m: [-5, 40], y_m: [-0.7, 9], height_max_m: 9}",
            f"{PAPER} with --set geofence: start: 'follower_1' would be outside the geofence: y = -0.50 m, "
            "at least -0.40 m (geofence.y_m)",
        ),
        (
            "geofence={x_m: [-5, 40], y_m: [-9, 9], height_max_m: 9, reaction: land}",
            f"{PAPER} with --set geofence: geofence.reaction 'land' needs a section 'ground'; "
            "or choose 'hold'",
        ),
        (
            "separation={emergency_m: 0.5}",
            f"{PAPER} with --set separation: separation.emergency_m 0.5 must be more than 0.5 m, at which "
            "vehicles collide (2 x vehicle.collision_radius_m)",
        ),
        (
            "separation={warning_m: 1.1}",
            f"{PAPER} with --set separation: formation 'initial' is impossible: 'follower_1' and "
            "'follower_2' are 1.000 m apart, at least 1.100 m are needed (separation.warning_m)",
        ),
        (
            "separation={warning_m: 0.6}",
            "--set separation: emergency_m 0.7 must be less than warning_m 0.6",
        ),
        (
            "vehicle.thrust_min_percent=50",
            f"{VEHICLE} with --set vehicle.thrust_min_percent: thrust_min_percent 50 must be more than 52.0, "
            "with which the vehicle can just hover",
        ),
        (
            "vehicle.rotor_speed_max_rpm=3000",
            f"{VEHICLE} with --set vehicle.rotor_speed_max_rpm: cannot hover: "
            "the rotors carry the weight at 4328 rpm, "
            "which is not within rotor_speed_min_rpm 1200 ... rotor_speed_max_rpm 3000",
        ),
        (
            "controller.formation_ramp_s=1",
            f"{CONTROLLER} with --set controller.formation_ramp_s: "
            "exactly one of formation_change and formation_ramp_s must have a value",
        ),
        (
            "sensors.sonar.range_min_m=11",
            f"{SENSORS}: sonar with --set sensors.sonar.range_min_m: "
            "range_min_m 11.0 must be less than range_max_m 10.0",
        ),
        (
            "sensors.range_bearing.range_max_m=0.1",
            f"{SENSORS}: range_bearing with --set sensors.range_bearing.range_max_m: "
            "range_min_m 0.1 must be less than range_max_m 0.1",
        ),
        (
            "sensors.range_bearing.sectors.0.elevation_min_deg=75",
            f"{SENSORS}: range_bearing.sectors.0 "
            "with --set sensors.range_bearing.sectors.0.elevation_min_deg: "
            "elevation_min_deg 75 must be less than elevation_max_deg 60",
        ),
        (
            "sensors.range_bearing.sectors.0.azimuth_min_deg=180",
            f"{SENSORS}: range_bearing.sectors.0 with --set sensors.range_bearing.sectors.0.azimuth_min_deg: "
            "azimuth_min_deg and azimuth_max_deg must differ, both are 180",
        ),
    ],
)
def test_sections_that_contradict_themselves(override: str, problem: str) -> None:
    assert problem_of(override) == problem


@pytest.mark.parametrize(
    ("override", "problem"),
    [
        ("team.followers=[follower_1, follower_1]", "team: vehicle 'follower_1' is named twice"),
        ("team.followers=[leader, follower_1]", "team: vehicle 'leader' is named twice"),
        (
            "formations_m.wide.follower_2=[-1.0, -0.7, -0.5]",
            "formation 'wide' is impossible: 'follower_1' and 'follower_2' are 0.050 m apart, "
            "at least 0.500 m are needed",
        ),
        (
            "formations_m.wide.follower_1=[0.1, 0.2, 0.3]",
            "formation 'wide' is impossible: 'leader' and 'follower_1' are 0.374 m apart, "
            "at least 0.500 m are needed",
        ),
        (
            "formations_m.wide.follower_3=[-3, 0, 0]",
            "formation 'wide' names 'follower_3', which is no follower; followers are follower_1, follower_2",
        ),
        (
            "formations_m.wide={follower_1: [-1, 0, 0]}",
            "formation 'wide' has no position for 'follower_2'",
        ),
        (
            "formations_m.wide={follower_1: [-1, 0.25, -0.5], follower_2: [-1, -0.25, -0.5]}",
            "phases.3.formation: 'follower_1' and 'follower_2' would come within 0.000 m of each other "
            "on the way, at least 0.500 m are needed; put a phase with another formation before it",
        ),
        ("phases.0.formation=odd", "phase 'A' flies the unknown formation 'odd', known are initial, wide"),
        (
            "start.position_m=[0, 0, 0.45]",
            "start.position_m puts a vehicle at -0.050 m above ground; flights start airborne",
        ),
        ("phases.1.name=A", "phase 'A' is named twice"),
        ("phases.1.steady_from_s=5", "phases.1: steady_from_s 5.0 must be less than duration_s 5.0"),
        ("phases.1.duration_s=5.02", "phase 'B' lasts 5.02 s, not a multiple of controller.period_s 0.05"),
        (
            "phases.4.motion.climb_m_s=-1.9",
            "phases.4.motion: climb_m_s -1.9 must be less than speed_m_s 1.9 in magnitude",
        ),
        (
            "phases.4.motion.radius_m=-0.05",
            "phases.4.motion.radius_m: must be at least 0.1 in magnitude (got -0.05)",
        ),
        ("plant.step_s=0.003", "plant.step_s 0.003 does not divide controller.period_s 0.05"),
        (
            "events=[{kind: wind, start_s: 3, end_s: 2, target: leader, force_n: [0, 0, 1]}]",
            "events.0: start_s 3.0 must be less than end_s 2.0",
        ),
        (
            "events=[{kind: wind, start_s: 1, end_s: 2, target: follower_7, force_n: [0, 0, 1]}]",
            "event 'wind' targets the unknown vehicle 'follower_7', known are leader, follower_1, follower_2",
        ),
        (
            "events=[{kind: dropout, start_s: 1, end_s: 2, target: follower_1, sensor: localization, "
            "probability: 0.5}]",
            "event 'dropout': 'follower_1' has no localization, only the leader has",
        ),
        (
            "events=[{kind: occlusion, start_s: 1, end_s: 2, target: follower_1, hidden: follower_1}]",
            "event 'occlusion' hides 'follower_1' from 'follower_1', which is no other vehicle of the team",
        ),
        (
            "events=[{kind: localization_jump, start_s: 1, end_s: 2, target: follower_1, "
            "offset_m: [0.5, 0.0, 0.0]}]",
            "event 'localization_jump': 'follower_1' has no localization, only the leader has",
        ),
        (
            f"controller.constraints={{field_of_view: {{pairs: [[leader, ufo]], {VIEW}}}}}",
            "controller.constraints.field_of_view names the unknown vehicle 'ufo', known are leader, "
            "follower_1, follower_2",
        ),
        (
            f"controller.constraints={{field_of_view: {{pairs: [[leader, leader]], {VIEW}}}}}",
            "controller.constraints.field_of_view: 'leader' cannot observe itself",
        ),
    ],
)
def test_scenarios_that_contradict_themselves(override: str, problem: str) -> None:
    line, blamed = problem_of(override), f" with --set {override.partition('=')[0]}"
    assert line.startswith("--set ") or blamed in line
    assert line.replace(blamed, "") in (f"{PAPER}: {problem}", f"--set {problem}")


@pytest.mark.parametrize(
    ("override", "problem"),
    [
        ("controller.period_s=-1", "controller.period_s: must be greater than 0 (got -1)"),
        ("controller.period_s=", "controller.period_s: must be a number (got nothing)"),
        ("controller.perod_s=0.1", "controller.perod_s: unknown key (did you mean 'period_s'?)"),
        ("controller.horizon_steps=15.5", "controller.horizon_steps: must be a whole number (got 15.5)"),
        ("vehicle=12", "vehicle: must be a mapping of keys to values (got 12)"),
        ("lockstep.on_vehicle_lost=continue", "lockstep.on_vehicle_lost: must be 'abort' (got 'continue')"),
        ("name=Bad Name", "name: must match pattern '^[a-z][a-z0-9_]*$' (got 'Bad Name')"),
        (
            "formations_m={Vee: {follower_1: [-1, 0, 0], follower_2: [-2, 0, 0]}}",
            "formations_m.Vee: must match pattern '^[a-z][a-z0-9_]*$' (got 'Vee')",
        ),
        ("title=" + "x" * 500, f"title: must have at most 64 characters (got '{'x' * 56}...)"),
        ("phases=[]", "phases: must have at least 1 item(s) (got [])"),
        (
            "phases.4.motion.kind=loop",
            f"phases.4.motion.kind: must be one of {MOTIONS} (got 'loop')",
        ),
        (
            "phases.4.motion.kind=[1]",
            f"phases.4.motion.kind: must be one of {MOTIONS} (got '[1]')",
        ),
        ("phases.0.motion={ramp_s: 1}", "phases.0.motion.kind: missing key"),
        (
            "events=[{kind: hail}]",
            "events.0.kind: must be one of "
            "'wind', 'thrust_scale', 'thrust_decay', 'weak_rotor', 'outliers', 'dropout', 'occlusion', "
            "'localization_jump', 'command_loss', 'link' "
            "(got 'hail')",
        ),
        (
            f"events=[{{kind: thrust_scale, {EVENT}, scale: 2.5}}]",
            "events.0.scale: must be less than or equal to 2 (got 2.5)",
        ),
        (
            f"events=[{{kind: outliers, {EVENT}, probability: 0.1, range_std_m: 0, bearing_std_deg: 30}}]",
            "events.0.range_std_m: must be greater than 0 (got 0)",
        ),
        (
            f"events=[{{kind: dropout, {EVENT}, sensor: gps, probability: 0.5}}]",
            "events.0.sensor: must be "
            + ", ".join(f"'{sensor.name}'" for sensor in registry.SENSORS[:-1])
            + f" or '{registry.SENSORS[-1].name}' (got 'gps')",
        ),
        (
            f"events=[{{kind: command_loss, {EVENT}, probability: -0.5}}]",
            "events.0.probability: must be greater than or equal to 0 (got -0.5)",
        ),
        (
            f"events=[{{kind: link, {EVENT}, direction: left}}]",
            "events.0.direction: must be 'up', 'down' or 'both' (got 'left')",
        ),
        (
            "links={up: {burst_s: 0.5}}",
            "links.up: burst_s 0.5 and burst_interval_s None: give both, or none",
        ),
        ("seed=-1", "seed: must be a whole number of at least 0 (got -1)"),
        ("seed=true", "seed: must be a whole number of at least 0 (got True)"),
    ],
)
def test_bad_value_of_set_is_reported_for_set(override: str, problem: str) -> None:
    assert problem_of(override) == f"--set {problem}"


@pytest.mark.parametrize(
    ("override", "problem"),
    [
        ("controller.period_s", "must have the form some.key=value"),
        (" =3", "must have the form some.key=value"),
        (
            "controller.period_s=[1",
            "the value is not valid YAML: expected ',' or ']', but got '<stream end>'",
        ),
        ("controler.period_s=0.1", "unknown key 'controler' (did you mean 'controller'?)"),
        (
            "controller.weights.terminal_scale.x=1",
            "'controller.weights.terminal_scale' holds a value, not keys",
        ),
        ("phases.5.name=F", "unknown key '5'"),
        ("phases.-1.name=F", "unknown key '-1'"),
        ("start.position_m.3=1", "unknown key '3'"),
    ],
)
def test_set_of_an_unknown_key(override: str, problem: str) -> None:
    assert problem_of(override) == f"--set {override}: {problem}"


@pytest.mark.parametrize(
    ("override", "problem"),
    [
        (
            "start.position_m=[0, 0, 0.9]",
            "start: 'follower_1' takes off to 0.400 m above ground, at least 0.500 m are needed",
        ),
        (
            "formations_m.initial.follower_2=[-1.0, 0.2, 0.5]",
            "start: 'follower_1' and 'follower_2' take off 0.700 m apart, seen from above; at least 0.800 m "
            "are needed: the collision distance, and 0.15 m of drift each",
        ),
    ],
)
def test_impossible_take_offs(override: str, problem: str) -> None:
    load_scenario(PAPER, [override])  # possible without
    with pytest.raises(ConfigError) as caught:
        load_scenario(PAPER, [FROM_GROUND, override])
    assert str(caught.value).endswith(problem)


def test_formation_may_have_the_name_of_a_motion() -> None:
    """The validation adds the kind of a motion to the path of a key; a name of the file must stay in it."""
    formation = "{initial: {follower_1: [-1, 0, 0], follower_2: [-2, 0, 0]}, hover: {wind: [0, x, 0]}}"
    line = problem_of(f"formations_m={formation}")
    assert line == "--set formations_m.hover.wind.1: must be a number (got 'x')"


NO_YAML = "not valid YAML: "
NO_MAPPING = "must hold a mapping of keys to values at its top level"
NO_PLAIN_VALUE = "holds a value that is neither text, number, list nor mapping"


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"", f": {NO_MAPPING}"),
        (b"- 1\n- 2\n", f": {NO_MAPPING}"),
        (b"12: a\n", f": {NO_MAPPING}"),
        (b"name: a\nname: b\n", f':2:1: {NO_YAML}found duplicate key "name"'),
        (b"name: [a, b\ntitle: c\n", f":2:6: {NO_YAML}expected ',' or ']'"),
        (b"name:\n\t- a\n", f":2:1: {NO_YAML}found character '\\t' that cannot start any token"),
        (b"name: a\n---\nname: b\n", f":2:1: {NO_YAML}but found another document"),
        (b"name: !!python/object:os.system ls\n", f":1:7: {NO_YAML}could not determine a constructor"),
        (b"name: *anchor\n", f":1:7: {NO_YAML}found undefined alias"),
        (b"name: \x00\n", f": {NO_YAML}unacceptable character"),
        (b"\x89PNG\r\n\x1a\n\x00\xff", ": cannot be read: not a text file in UTF-8"),
    ],
)
@pytest.mark.parametrize("section", [None, "sensors"])
def test_file_without_configuration(
    section: str | None, content: bytes, problem: str, tmp_path: Path
) -> None:
    path = tmp_path / "bad.yaml"
    path.write_bytes(content)
    with pytest.raises(ConfigError) as caught:
        load_scenario(path) if section is None else load_scenario(PAPER, [f"{section}={path}"])
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}{problem}")


@pytest.mark.parametrize("value", ["&a [*a]", "!!binary /w=="])
def test_set_value_of_a_type_that_configuration_has_not(value: str) -> None:
    assert problem_of(f"title={value}") == f"--set title={value}: {NO_PLAIN_VALUE}"


def test_contradiction_within_a_file_does_not_blame_an_override_elsewhere(tmp_path: Path) -> None:
    path = tmp_path / "sensors.yaml"
    path.write_text(SENSORS.read_text().replace("range_min_m: 0.1", "range_min_m: 99"))
    with pytest.raises(ConfigError) as caught:
        load_scenario(PAPER, [f"sensors={path}", "sensors.imu.gyro_std_deg_s=1", "title=another"])
    assert all(line.startswith(f"{path}: ") for line in str(caught.value).splitlines())
    assert "--set" not in str(caught.value)


def test_value_in_a_file_of_a_type_that_configuration_has_not(tmp_path: Path) -> None:
    path = tmp_path / "scenario.yaml"
    path.write_text(load_scenario(PAPER).effective_yaml.replace("title: ", "title: !!binary /w== #"))
    with pytest.raises(ConfigError) as caught:
        load_scenario(path)
    assert str(caught.value) == f"{path}: {NO_PLAIN_VALUE}"


def test_every_type_of_pydantic_error_has_our_words_or_its_own(tmp_path: Path) -> None:
    """A type that is not in our table keeps the message of pydantic."""

    class Odd(Schema):
        even: Annotated[int, Field(multiple_of=2)]

    with pytest.raises(ValidationError) as caught:
        Odd.model_validate_json('{"even": 3}')
    line = explain(caught.value, {"even": 3}, Origins("odd.yaml"), Odd)
    assert line == "odd.yaml: even: Input should be a multiple of 2 (got 3)"


def test_path_without_a_file(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=rf"^{tmp_path}: cannot be read: Is a directory$"):
        load_scenario(tmp_path)
    with pytest.raises(ConfigError, match=rf"^{tmp_path}/none.yaml: no such file$"):
        load_scenario(tmp_path / "none.yaml")
    with pytest.raises(ConfigError, match=rf"^{tmp_path}/none.yaml: no such file$"):
        load_scenario(PAPER, [f"controller={tmp_path}/none.yaml"])


def test_bad_seed_in_the_file(tmp_path: Path) -> None:
    path = tmp_path / "scenario.yaml"
    path.write_text(load_scenario(PAPER).effective_yaml.replace("seed: 0", "seed: 2.5"))
    with pytest.raises(
        ConfigError, match=rf"^{path}: seed: must be a whole number of at least 0 \(got 2\.5\)$"
    ):
        load_scenario(path)
