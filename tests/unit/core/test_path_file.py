"""Files with a path of the leader: read, written, named in a scenario, and refused."""

from pathlib import Path

import numpy as np
import pytest

from relform_core.errors import ConfigError
from relform_core.load import load_scenario, load_scenario_text
from relform_core.path_file import read_path, write_path
from support.scenarios import PAPER, paper_scenario

GOOD = "t_s,x_m,y_m,z_m\n10,1,2,3\n12,2,2,3\n\n14,2,3,3.5\n"


def problem_of(text: str, tmp_path: Path, *overrides: str) -> str:
    """The one line about a file in the paper's second phase, which lasts 5 s, without the names of files."""
    file = tmp_path / "path.csv"
    file.write_text(text)
    with pytest.raises(ConfigError) as caught:
        paper_scenario(f"phases.1.motion={{kind: path, file: {file}}}", *overrides)
    (line,) = str(caught.value).splitlines()
    return line.replace(str(file), "FILE").replace(str(PAPER), "SCENARIO")


def test_read_what_was_written(tmp_path: Path) -> None:
    samples = np.array([[0.0, 1.5, -2.25, 3.0, 370.5], [0.125, -1.5, 2.25, 3.0001, -20.25]])
    write_path(tmp_path / "path.csv", samples)
    found = read_path(tmp_path / "path.csv")
    np.testing.assert_array_equal(found["times_s"], samples[:, 0])
    np.testing.assert_array_equal(found["points_m"], samples[:, 1:4])
    np.testing.assert_array_equal(found["yaws_deg"], samples[:, 4])


def test_file_is_beside_the_scenario_and_its_samples_are_in_the_effective_configuration(
    tmp_path: Path,
) -> None:
    """So a recording needs the file no more."""
    loaded = paper_scenario("phases.1.motion={kind: hover, ramp_s: 1}")
    hover = "{kind: hover, ramp_s: 1}"
    assert hover in loaded.effective_yaml
    scenario = tmp_path / "scenario.yaml"
    scenario.write_text(loaded.effective_yaml.replace(hover, "{kind: path, file: its.csv}"))
    (tmp_path / "its.csv").write_text(GOOD)
    flown = load_scenario(scenario)
    (tmp_path / "its.csv").unlink()
    assert load_scenario_text(flown.effective_yaml, "recording").config == flown.config
    motion = flown.config.phases[1].motion
    assert motion.kind == "path"
    assert motion.times == (10.0, 12.0, 14.0)
    assert motion.points[2] == (2.0, 3.0, 3.5)
    assert motion.yaws is None


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "FILE:1: must be the header 't_s,x_m,y_m,z_m' or 't_s,x_m,y_m,z_m,yaw_deg' (got '')"),
        (
            GOOD.replace("t_s", "t"),
            "FILE:1: must be the header 't_s,x_m,y_m,z_m' or 't_s,x_m,y_m,z_m,yaw_deg' (got 't,x_m,y_m,z_m')",
        ),
        (GOOD.replace("2,3,3.5", "2,3"), "FILE:5: must have 4 values (got 3)"),
        (GOOD.replace("3.5", "up"), "FILE:5: z_m: must be a finite number (got 'up')"),
        (GOOD.replace("3.5", "3\x005"), r"FILE:5: z_m: must be a finite number (got '3\x005')"),
        (GOOD.replace("3.5", "nan"), "FILE:5: z_m: must be a finite number (got 'nan')"),
    ],
)
def test_bad_file(text: str, problem: str, tmp_path: Path) -> None:
    assert problem_of(text, tmp_path) == f"--set phases.1.motion.file: {problem}"


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("t_s,x_m,y_m,z_m\n0,0,0,0\n", ".times_s: must have at least 2 item(s) (got [0.0])"),
        (GOOD.replace("14,", "12,"), ": times_s must increase (got 12.0 after 12.0)"),
        (
            GOOD.replace("2,3,3.5", "2,-1002,3"),
            ": points_m.2 is at (2.0, -1002.0, 3.0), at most 1000 m from the first is possible",
        ),
    ],
)
def test_bad_samples(text: str, problem: str, tmp_path: Path) -> None:
    assert problem_of(text, tmp_path) == f"--set phases.1.motion{problem}"


@pytest.mark.parametrize(
    ("motion", "problem"),
    [
        ("{kind: path}", ".file: missing key"),
        ("{kind: path, file: 3}", ".file: must be text (got 3)"),
        ("{kind: path, file: a.csv, times_s: [0, 1]}", ".file: gives the samples, so times_s must go"),
        ("{kind: path, file: nowhere.csv}", ".file: nowhere.csv: no such file"),
        ("{kind: path, times_s: [0, 1]}", ".points_m: missing key"),
        (
            "{kind: path, times_s: [0, 1], points_m: [[0, 0, 0]]}",
            ": times_s has 2 items, but points_m has 1",
        ),
        (
            "{kind: path, times_s: [0, 1], points_m: [[0, 0, 0], [1, 0, 0]], yaws_deg: [0, 1, 2]}",
            ": times_s has 2 items, but yaws_deg has 3",
        ),
    ],
)
def test_bad_motion(motion: str, problem: str) -> None:
    with pytest.raises(ConfigError) as caught:
        paper_scenario(f"phases.1.motion={motion}")
    assert str(caught.value) == f"--set phases.1.motion{problem}"


@pytest.mark.parametrize(
    ("points", "broken"),
    [
        # rest to rest over a length d in a time T: a cubic, with 1.5 d / T at most, and 6 d / T^2 at its ends
        ("4,6,0,0,0", "speed 2.25 m/s after 2.00 s, at most 2 m/s"),
        ("2,2,0,0,0", "acceleration 3.00 m/s^2 after 0.00 s, at most 2 m/s^2"),
        ("2,0,0,0,140", "turn rate 105.00 deg/s after 1.00 s, at most 90 deg/s"),
    ],
)
def test_path_that_is_too_fast_names_limit_and_time(points: str, broken: str, tmp_path: Path) -> None:
    line = problem_of(f"t_s,x_m,y_m,z_m,yaw_deg\n0,0,0,0,0\n{points}\n", tmp_path)
    assert line == (f"--set phases.1.motion: motion 'path' is too fast: {broken} (controller.leader_motion)")


def test_limits_are_those_of_the_controller(tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("t_s,x_m,y_m,z_m\n0,0,0,0\n4,6,0,0\n")
    motion = f"phases.1.motion={{kind: path, file: {tmp_path / 'path.csv'}}}"
    limits = "controller.leader_motion={speed_max_m_s: 2.3, acceleration_max_m_s2: 2.3}"
    assert paper_scenario(motion, limits).config.phases[1].motion.kind == "path"


def test_path_longer_than_its_phase_and_into_the_ground(tmp_path: Path) -> None:
    header = "t_s,x_m,y_m,z_m\n"
    assert problem_of(f"{header}1,0,0,9\n6.5,1,0,9\n", tmp_path).endswith(
        "motion 'path' takes 5.500 s from rest to rest, more than duration_s 5.0"
    )
    assert problem_of(f"{header}0,0,0,9\n2.5,1,0,7.4\n5,2,0,9\n", tmp_path).endswith(
        "phase 'B' takes follower_1 to -0.100 m above ground, more than 0 m are needed: "
        "start higher, or descend less"
    )
