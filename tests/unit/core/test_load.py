"""Loading good scenarios: units, overrides, sections in files, and the effective configuration."""

import math
import re
from pathlib import Path
from typing import Any

import pytest

from relform_core.errors import ConfigError
from relform_core.load import load_scenario, load_scenario_text
from relform_core.phases_config import Hover, Spiral, Turn
from relform_core.yaml_files import parse_mapping, to_text
from support.scenarios import CONFIG_FOLDER, PAPER, paper_scenario, team_of

SCENARIOS = sorted((CONFIG_FOLDER / "scenarios").glob("*.yaml"))


def test_values_are_converted_once_to_si_and_radians() -> None:
    config = load_scenario(PAPER).config
    assert config.vehicle.rotor_speed_max == pytest.approx(200.0 * math.pi)  # 6000 rpm
    assert config.vehicle.tilt_max == pytest.approx(1.4835298641951802)  # 85 deg
    assert config.vehicle.inertia_std == pytest.approx(0.05)
    assert config.sensors.imu.gyro_std == pytest.approx(0.05235987755982989)  # 3 deg/s
    assert config.sensors.range_bearing.sectors[0].elevation_min == pytest.approx(-math.pi / 3.0)
    assert config.controller.relative_yaw_std_max == pytest.approx(math.pi / 9.0)
    turn = config.phases[2].motion
    assert isinstance(turn, Turn)
    assert turn.angle == pytest.approx(math.pi / 2.0)


def test_phase_starts() -> None:
    config = load_scenario(PAPER).config
    assert config.phase_starts == (0, 20, 120, 220, 300)
    assert config.phase_start_times == (0.0, 1.0, 6.0, 11.0, 15.0)
    names = "".join(config.phase_at(step).name for step in range(config.n_steps))
    assert names == "A" * 20 + "B" * 100 + "C" * 100 + "D" * 80 + "E" * 240
    assert config.phase_at(config.n_steps + 7).name == "E"
    with pytest.raises(ValueError, match=r"^control steps start at 0 \(got -1\)$"):
        config.phase_at(-1)


def test_phase_starts_do_not_add_up_rounding_errors() -> None:
    """0.15 / 0.05 is 2.9999999999999996; the error of a sum of many such phases is larger."""
    phases = ", ".join(
        f"{{name: P{number}, title: hover, duration_s: 0.15, steady_from_s: 0.0, formation: initial, "
        "motion: {kind: hover, ramp_s: 0.0}}"
        for number in range(1000)
    )
    config = load_scenario(PAPER, [f"phases=[{phases}]"]).config
    assert config.phase_starts == tuple(range(0, 3000, 3))
    assert config.n_steps == 3000


def test_configuration_of_an_older_version() -> None:
    """It has one time for all changes of formation; no change is refused, as it was flown."""
    tree = parse_mapping(load_scenario(PAPER).effective_yaml, "paper")
    del tree["controller"]["formation_change"], tree["phases"][3]["formation_step"]
    tree["controller"]["formation_ramp_s"] = 0.5
    tree["formations_m"]["wide"] = {"follower_1": [-1, 0.75, -0.5], "follower_2": [-1, -0.75, -0.5]}
    loaded = load_scenario_text(to_text(tree), "config.yaml")
    assert loaded.config.controller.formation_ramp == 0.5
    assert loaded.config.controller.formation_change is None
    assert load_scenario_text(loaded.effective_yaml, "config.yaml").config == loaded.config


def test_derived_values() -> None:
    config = load_scenario(PAPER).config
    assert config.duration == pytest.approx(27.0)
    assert config.n_steps == 540
    assert config.period_ns == 50_000_000
    assert config.team.vehicles == ("leader", "follower_1", "follower_2")
    # 0.716 kg * 9.81 m/s^2 on four rotors of 8.54858e-6 N s^2 each
    assert config.vehicle.hover_thrust == pytest.approx(1.75599)
    assert config.vehicle.hover_speed == pytest.approx(453.22, abs=0.01)


def test_kind_selects_the_type_of_a_motion() -> None:
    kinds = [type(phase.motion) for phase in load_scenario(PAPER).config.phases]
    assert kinds[0] is Hover
    assert kinds[4] is Spiral


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_effective_configuration_reloads_to_an_identical_one(path: Path, tmp_path: Path) -> None:
    loaded = load_scenario(path, ["controller.horizon_steps=9", "vehicle.mass_kg=0.7251"], seed=11)
    copy = tmp_path / "effective.yaml"
    copy.write_text(loaded.effective_yaml)
    again = load_scenario(copy)
    assert again.config == loaded.config
    assert again.seed == loaded.seed == 11
    assert again.effective_yaml == loaded.effective_yaml


def test_path_may_be_text() -> None:
    assert load_scenario(str(PAPER)) == load_scenario(PAPER)


def test_scenario_from_its_text(tmp_path: Path) -> None:
    loaded = load_scenario(PAPER, ["controller.horizon_steps=9"], seed=11)
    again = load_scenario_text(loaded.effective_yaml, "an attachment")
    assert again == loaded
    assert load_scenario_text(loaded.effective_yaml, "an attachment", ["title=x"], 3).seed == 3
    with pytest.raises(ConfigError, match=r"^an attachment: vehicle.mass_kg: missing key$"):
        load_scenario_text(loaded.effective_yaml.replace("mass_kg: 0.716", ""), "an attachment")
    with pytest.raises(ConfigError, match=r"^an attachment:1:7: not valid YAML: "):
        load_scenario_text("name: *anchor\n", "an attachment")


@pytest.mark.parametrize("name", ["paper", "retuned"])
def test_plain_name_is_an_installed_file(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the scenario's file, on the command line, and whatever the working directory has."""
    path = CONFIG_FOLDER / f"controller/{name}.yaml"
    expected = load_scenario(PAPER, [f"controller={path}"])
    (tmp_path / name).write_text("of no interest")
    monkeypatch.chdir(tmp_path)
    assert load_scenario("paper", [f"controller={name}"]) == expected
    scenario = tmp_path / "scenario.yaml"
    scenario.write_text(expected.effective_yaml)
    tree = expected.written | {"controller": name, "vehicle": "hummingbird", "sensors": "paper"}
    scenario.write_text(to_text(tree))
    assert load_scenario(scenario) == expected


@pytest.fixture
def changed_file(tmp_path: Path) -> Path:
    """A scenario with a section in a file, one key of which it replaces."""
    path = tmp_path / "scenario.yaml"
    controller = {"file": "team", "horizon_steps": 12}
    path.write_text(to_text(load_scenario(PAPER).written | {"controller": controller}))
    return path


def test_section_in_a_file_with_replaced_keys(changed_file: Path) -> None:
    overrides = ["controller=team", "controller.horizon_steps=12"]
    assert load_scenario(changed_file).config == load_scenario(PAPER, overrides).config
    loaded = load_scenario(changed_file, ["controller.horizon_steps=13"])
    assert loaded.config.controller.horizon_steps == 13
    assert load_scenario(changed_file, ["controller=team"]).config.controller.horizon_steps == 15


def test_problem_of_a_replaced_key_names_the_scenario(changed_file: Path) -> None:
    changed_file.write_text(changed_file.read_text().replace("horizon_steps: 12", "horizon_steps: 1"))
    message = f"{changed_file}: controller.horizon_steps: must be greater than or equal to 2 (got 1)"
    with pytest.raises(ConfigError, match=f"^{re.escape(message)}$"):
        load_scenario(changed_file)
    changed_file.write_text(changed_file.read_text().replace("file: team", "file: 3.25"))
    message = f"{changed_file}: controller.file: must be text (got 3.25)"
    with pytest.raises(ConfigError, match=f"^{re.escape(message)}$"):
        load_scenario(changed_file)


def test_problem_of_a_key_in_the_file_names_the_file(changed_file: Path) -> None:
    file = changed_file.with_name("changed.yaml")
    file.write_text((CONFIG_FOLDER / "controller/team.yaml").read_text().replace("0.05", "-1"))
    changed_file.write_text(changed_file.read_text().replace("file: team", "file: changed.yaml"))
    message = f"{file}: period_s: must be greater than 0 (got -1)"
    with pytest.raises(ConfigError, match=f"^{re.escape(message)}$"):
        load_scenario(changed_file)


def test_unknown_plain_name_is_one_line_with_the_known_ones(tmp_path: Path) -> None:
    expected = "expected a file name (.yaml) or one of"
    with pytest.raises(ConfigError, match=rf"^unknown scenario 'papr' .*: {re.escape(expected)} .*\bpaper\b"):
        load_scenario("papr")
    message = (
        f"--set controller=turbo: unknown controller 'turbo': {expected} paper, retuned, team, team_100hz"
    )
    with pytest.raises(ConfigError, match=f"^{re.escape(message)}$"):
        load_scenario(PAPER, ["controller=turbo"])
    scenario = tmp_path / "scenario.yaml"
    scenario.write_text(to_text(load_scenario(PAPER).written | {"vehicle": "zeppelin"}))
    message = f"{scenario}: vehicle: unknown vehicle 'zeppelin': {expected} crazyflie, hummingbird"
    with pytest.raises(ConfigError, match=f"^{re.escape(message)}$"):
        load_scenario(scenario)


def test_plain_name_where_nothing_is_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AMENT_PREFIX_PATH", "/nowhere")
    message = r"^unknown scenario 'paper': expected a file name \(\.yaml\); relform_bringup is not installed$"
    with pytest.raises(ConfigError, match=message):
        load_scenario("paper")


def test_overrides_change_single_values_and_items() -> None:
    config = load_scenario(
        PAPER,
        [
            "controller.weights.formation_per_m2=7.5",
            "start.position_m.2=3.25",
            "phases.1.motion.speed_m_s=1.5",
            "title=another",
            "events=[{kind: wind, start_s: 1, end_s: 2.5, target: follower_2, force_n: [0.1, 0.2, -0.3]}]",
            *team_of(4),
        ],
    ).config
    assert config.controller.weights.formation == 7.5
    assert config.start.position == (0.0, 0.0, 3.25)
    assert config.phases[1].motion.speed == 1.5
    assert config.title == "another"
    assert [config.events[0].active(time) for time in (0.99, 1.0, 2.49, 2.5)] == [False, True, True, False]
    assert len(config.team.vehicles) == 4


def test_override_of_a_whole_section_comes_first(tmp_path: Path) -> None:
    """The other file is read first, so that an override of one of its keys takes effect."""
    other = tmp_path / "other.yaml"
    text = (CONFIG_FOLDER / "controller/paper.yaml").read_text()
    other.write_text(re.sub("horizon_steps: .*", "horizon_steps: 7", text))
    overrides = ["controller.weights.terminal_scale=3.5", f"controller={other}"]
    config = load_scenario(PAPER, overrides).config
    assert config.controller.horizon_steps == 7
    assert config.controller.weights.terminal_scale == 3.5
    assert config.controller.weights.torque == 100.0


def test_file_of_a_section_on_the_command_line_is_relative_to_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = (CONFIG_FOLDER / "vehicles/hummingbird.yaml").read_text()
    (tmp_path / "heavy.yaml").write_text(text.replace("mass_kg: 0.716", "mass_kg: 0.9"))
    monkeypatch.chdir(tmp_path)
    assert load_scenario(PAPER, ["vehicle=heavy.yaml"]).config.vehicle.mass == 0.9


def test_seed_of_the_caller_goes_before_the_file_and_the_default(tmp_path: Path) -> None:
    assert load_scenario(PAPER).seed == 0
    assert load_scenario(PAPER, ["seed=5"]).seed == 5
    assert load_scenario(PAPER, ["seed=5"], seed=6).seed == 6


def test_all_problems_are_reported_together() -> None:
    with pytest.raises(ConfigError) as caught:
        load_scenario(PAPER, ["controller.period_s=-0.05", "vehicle.mass_kg=heavy", "plant.step=1"])
    assert str(caught.value).splitlines() == [
        "--set vehicle.mass_kg: must be a number (got 'heavy')",
        "--set controller.period_s: must be greater than 0 (got -0.05)",
        "--set plant.step: unknown key (did you mean 'step_s'?)",
    ]


def test_the_fingerprint_depends_on_values_and_seed_only() -> None:
    assert paper_scenario(seed=1).fingerprint == paper_scenario("vehicle.tilt_max_deg=85", seed=1).fingerprint
    others = (paper_scenario(seed=2), paper_scenario("vehicle.tilt_max_deg=84", seed=1))
    assert len({each.fingerprint for each in (paper_scenario(seed=1), *others)}) == 3
    assert paper_scenario(seed=1).with_seed(2).fingerprint == paper_scenario(seed=2).fingerprint


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("vehicle", "/etc/passwd"),
        ("sensors", "paper"),
        ("controller", {"file": "../../controller.yaml", "horizon_steps": 20}),
    ],
)
def test_the_text_of_a_recording_names_no_files(key: str, value: Any) -> None:
    text = to_text({**load_scenario(PAPER).written, key: value})
    with pytest.raises(ConfigError, match=f"^a bag: {key}: names a file, but must hold everything itself$"):
        load_scenario_text(text, "a bag", names_files=False)


def test_a_motion_of_a_recording_names_no_file() -> None:
    loaded = load_scenario(PAPER)
    tree = {**loaded.written, "phases": [{"name": "A", "motion": {"kind": "path", "file": "/etc/passwd"}}]}
    with pytest.raises(ConfigError, match=r"^a bag: phases\.0\.motion: names a file"):
        load_scenario_text(to_text(tree), "a bag", names_files=False)
    again = load_scenario_text(loaded.effective_yaml, "a bag", ["controller=team"], names_files=False)
    assert again.config == load_scenario(PAPER, ["controller=team"]).config
