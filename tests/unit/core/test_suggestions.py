"""A misspelt name gives an error that suggests the right one."""

from pathlib import Path

import pytest

from relform_bags.reader import bag_files
from relform_core.errors import BagError, ConfigError
from relform_core.formations_config import shape_from_text
from relform_core.load import load_scenario
from relform_core.script import CommandParser
from relform_core.suggestions import did_you_mean
from support.scenarios import PAPER, paper_scenario


def problem_of(*overrides: str) -> str:
    with pytest.raises(ConfigError) as caught:
        load_scenario(PAPER, overrides)
    (line,) = str(caught.value).splitlines()
    return line


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("perod_s", "period_s"),
        ("price", "price_per_unit"),
        ("speed", "speed_m_s"),
        ("speed_mps", "speed_m_s"),
    ],
)
def test_close_names_and_keys_without_their_unit(name: str, meant: str) -> None:
    known = ("speed_max_m_s", "period_s", "price_per_unit", "speed_m_s")
    assert did_you_mean(name, known) == f" (did you mean '{meant}'?)"


def test_no_suggestion_where_nothing_is_close() -> None:
    assert did_you_mean("wings", ("mass_kg", "arm_length_m")) == ""


@pytest.mark.parametrize(
    ("override", "end"),
    [
        ("vehicle.mass=0.7", "vehicle.mass: unknown key (did you mean 'mass_kg'?)"),
        ("vehicle.failsafe.plan_max=1", "failsafe.plan_max: unknown key (did you mean 'plan_max_s'?)"),
        ("sensors.imu.gyro_std_rad_s=1", "imu.gyro_std_rad_s: unknown key (did you mean 'gyro_std_deg_s'?)"),
        ("phases.4.motion.radius=2", "motion.radius: unknown key (did you mean 'radius_m'?)"),
        (
            "phases.0.motion={kind: straight, ramp_s: 1, speed_m_s: 1, radius_m: 1}",
            "motion.radius_m: unknown key",  # that of another motion is none of this one
        ),
        (
            "events=[{kind: wind, start_s: 1, end_s: 2, target: leader, force_n: [0, 0, 1], ent_s: 3}]",
            "events.0.ent_s: unknown key (did you mean 'end_s'?)",
        ),
        ("links={up: {loss: 0.1}}", "links.up.loss: unknown key (did you mean 'loss_probability'?)"),
        (
            "formations_m.wide={kind: v, spacing_m: 1, oppening_deg: 90}",
            "formations_m.wide.oppening_deg: unknown key (did you mean 'opening_deg'?)",
        ),
        (
            "controller.estimator={kind: team, gate_sightings: true}",
            "controller.estimator.gate_sightings: unknown key (did you mean 'gates_sightings'?)",
        ),
        ("fases=[]", "fases: unknown key (did you mean 'phases'?)"),
        ("formations_m.wide={kind: shpere, spacing_m: 1}", "(got 'shpere') (did you mean 'sphere'?)"),
        ("phases.0.motion.kind=hoover", "(got 'hoover') (did you mean 'hover'?)"),
        ("sensing=rnig", "(got 'rnig') (did you mean 'ring'?)"),
        ("controller.solver.warm_start=transfrom", "(got 'transfrom') (did you mean 'transform'?)"),
        ("contoller.horizon_steps=9", "unknown key 'contoller' (did you mean 'controller'?)"),
        ("controller.weigths.terminal_scale=9", "unknown key 'weigths' (did you mean 'weights'?)"),
        ("controller=taem", "unknown controller 'taem' (did you mean 'team'?)"),
        ("vehicle=humingbird", "unknown vehicle 'humingbird' (did you mean 'hummingbird'?)"),
    ],
)
def test_misspelt_key_or_name(override: str, end: str) -> None:
    assert problem_of(override).partition(": expected a file")[0].endswith(end)


def test_misspelt_file(tmp_path: Path) -> None:
    (tmp_path / "scenario.yaml").touch()
    with pytest.raises(
        ConfigError, match=r"scenari\.yaml: no such file \(did you mean 'scenario\.yaml'\?\)$"
    ):
        load_scenario(tmp_path / "scenari.yaml")


def test_misspelt_run(tmp_path: Path) -> None:
    (tmp_path / "latest").mkdir()
    with pytest.raises(BagError, match=r"lates: no such file or folder \(did you mean 'latest'\?\)$"):
        bag_files(tmp_path / "lates")


def test_misspelt_key_of_a_shape_in_a_request() -> None:
    with pytest.raises(ConfigError, match=r"request: spacing: unknown key \(did you mean 'spacing_m'\?\)"):
        shape_from_text("{kind: line, spacing: 1.0}", "request")


def test_misspelt_option(capsys: pytest.CaptureFixture[str]) -> None:
    parser = CommandParser(prog="fly")
    parser.add_overrides("")
    parser.add_argument("--scenario")
    with pytest.raises(SystemExit):
        parser.parse_args(["--senario=paper"])
    expected = "error: unrecognized arguments: --senario=paper (did you mean '--scenario'?); see fly --help\n"
    assert capsys.readouterr().err == expected


def test_incomplete_section_that_the_file_leaves_out_blames_the_override() -> None:
    with pytest.raises(ConfigError) as caught:
        load_scenario(PAPER, ["controller.constraints.tilt.max_deg=40"])
    where = "--set controller.constraints.tilt"
    assert str(caught.value).splitlines() == [
        f"{where}.price_per_unit: missing key",
        f"{where}.square_price_per_unit2: missing key",
    ]


def test_set_reaches_a_key_of_a_section_that_the_file_leaves_out() -> None:
    ground = paper_scenario("ground.time_s=31.5", "controller.leader_motion.speed_max_m_s=1.5").config
    assert ground.ground is not None
    assert (ground.ground.time, ground.controller.leader_motion.speed_max) == (31.5, 1.5)
