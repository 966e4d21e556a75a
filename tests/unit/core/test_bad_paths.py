"""Paths of the leader that are impossible give one line with key, value and bound."""

import pytest

from relform_core.errors import ConfigError
from support.scenarios import PAPER, paper_scenario

ROUND = "speed_m_s: 1.0, ramp_s: 1.5"


def problem_of(*overrides: str) -> str:
    with pytest.raises(ConfigError) as caught:
        paper_scenario(*overrides)
    (line,) = str(caught.value).splitlines()
    return line


def course(points: str, speed: float = 1.5, ramp: float = 1.2) -> str:
    return f"kind: waypoints, points_m: {points}, speed_m_s: {speed}, ramp_s: {ramp}"


@pytest.mark.parametrize(
    ("motion", "problem"),
    [
        (
            "kind: circle, radius_m: 2.0, speed_m_s: 8.0, ramp_s: 1.5",
            "speed_m_s 8.0 and radius_m 2.0 need 32.000 m/s^2, at most 10 m/s^2 is possible",
        ),
        (
            "kind: figure_eight, radius_m: 4.0, speed_m_s: 4.0, ramp_s: 0.5",
            "speed_m_s 4.0 and ramp_s need 12.000 m/s^2, at most 10 m/s^2 is possible",
        ),
        (
            "kind: circle, radius_m: 0.5, speed_m_s: 1.0, ramp_s: 4.0",
            "radius_m 0.5 gives a length of 3.142 m, at least speed_m_s * ramp_s = 4.000 m is needed",
        ),
        (
            course("[[4, 0, 0], [4, 1, 0]]"),
            "points_m.1 gives a length of 1.000 m, at least speed_m_s * ramp_s = 1.800 m is needed",
        ),
        (
            course("[[0, 4, 0]]"),
            "points_m.0 must be straight ahead, with forward > 0 and left 0 (got (0.0, 4.0, 0.0)): "
            "turn before, with a motion 'turn'",
        ),
        (course("[[4, 0, 0], [0, 0.1, 0]]"), "points_m.0 turns by 178.6 deg, at most 120 deg is possible"),
        (course("[[1, 0, -9]]"), "points_m.0 climbs or descends at 83.7 deg, at most 60 deg is possible"),
        (
            course("[[4, 0, 0], [4, 3, 0]]", speed=4.0, ramp=0.7),
            "speed_m_s 4.0 and points_m.0 need 12.122 m/s^2, at most 10 m/s^2 is possible",
        ),
    ],
)
def test_impossible_path(motion: str, problem: str) -> None:
    assert problem_of(f"phases.1.motion={{{motion}}}") == f"--set phases.1.motion: {problem}"


@pytest.mark.parametrize(
    ("motion", "problem"),
    [
        ("kind: circle, radius_m: 2.0, speed_m_s: 0, ramp_s: 1", "speed_m_s: must be greater than 0 (got 0)"),
        (
            "kind: circle, radius_m: 2.0, speed_m_s: 1, ramp_s: 0",
            "ramp_s: must be greater than or equal to 0.1 (got 0)",
        ),
        (f"kind: circle, radius_m: 2.0, turns: 1.5, {ROUND}", "turns: must be a whole number (got 1.5)"),
        (f"kind: circle, {ROUND}", "radius_m: missing key"),
        (course("[]"), "points_m: must have at least 1 item(s) (got [])"),
        (course("[[4, 0, x]]"), "points_m.0.2: must be a number (got 'x')"),
        (course("[[2000, 0, 0]]"), "points_m.0.0: must be less than or equal to 1000 (got 2000)"),
        (
            f"kind: circle, radius_m: -0.05, {ROUND}",
            "radius_m: must be at least 0.1 and at most 1000 in magnitude (got -0.05)",
        ),
    ],
)
def test_bad_key_of_a_path(motion: str, problem: str) -> None:
    assert problem_of(f"phases.1.motion={{{motion}}}") == f"--set phases.1.motion.{problem}"


CIRCLE = f"{{kind: circle, radius_m: 2.0, {ROUND}}}"


def test_path_longer_than_its_phase() -> None:
    """4 pi metres at 1 m/s and a ramp of 1.5 s take 14.066 s."""
    line = problem_of(f"phases.4.motion={CIRCLE}")
    assert line == (
        f"{PAPER}: phases.4 with --set phases.4.motion: motion 'circle' takes 14.066 s from rest to rest, "
        "more than duration_s 12.0"
    )


@pytest.mark.parametrize(
    "before",
    [
        "{kind: straight, speed_m_s: 1.0, ramp_s: 0.5}",
        "{kind: spiral, radius_m: 2.0, speed_m_s: 1.0, climb_m_s: 0.1, ramp_s: 0.5}",
        "{kind: turn, angle_deg: 90, turn_s: 4.5}",  # its phase ends before
    ],
)
def test_path_that_would_start_in_motion(before: str) -> None:
    line = problem_of("phases.4.duration_s=15", f"phases.3.motion={before}", f"phases.4.motion={CIRCLE}")
    assert line.endswith(
        ": phase 'E' must start at rest for its motion 'circle': "
        "hover before, with a ramp_s within duration_s"
    )


def test_path_after_hover_or_another_path() -> None:
    config = paper_scenario(
        *("phases.3.motion={kind: hover, ramp_s: 4.0}", "phases.4.duration_s=15", f"phases.4.motion={CIRCLE}")
    ).config
    assert config.phases[4].motion.kind == "circle"
    turn = "{kind: turn, angle_deg: 90, turn_s: 2.0}"
    paper_scenario(
        *("phases.1.duration_s=15", f"phases.1.motion={CIRCLE}", f"phases.2.motion={turn}"),
        *("phases.3.duration_s=15", f"phases.3.motion={CIRCLE}"),
    )


DOWN = "{kind: waypoints, points_m: [[4, 0, -1.25], [8, 0, 0]], speed_m_s: 1.5, ramp_s: 1.2}"
FLY_DOWN = ("phases.1.duration_s=8", f"phases.1.motion={DOWN}")
SINK = "{kind: spiral, radius_m: 3.0, speed_m_s: 1.0, climb_m_s: -0.5, ramp_s: 2.0}"


@pytest.mark.parametrize(
    ("overrides", "phase", "vehicle", "height"),
    [
        (("start.position_m=[0, 0, 1.25]", *FLY_DOWN), "B", "the leader", "0.000"),
        (
            ("formations_m.initial.follower_2=[-1, 0.5, -0.9]", *FLY_DOWN),
            "B",
            "follower_2",
            "-0.150",
        ),
        # 2 m, less 10 s at -0.5 m/s, of which the ramp costs 0.5 m
        (("phases.3.duration_s=10", f"phases.3.motion={SINK}"), "D", "the leader", "-2.500"),
        (
            # the turn sinks on, 12 s from 2.5 m
            (
                "start.position_m=[0, 0, 7]",
                "phases.3.duration_s=10",
                f"phases.3.motion={SINK}",
                "phases.4.motion={kind: turn, angle_deg: 30, turn_s: 2}",
            ),
            "E",
            "the leader",
            "-3.500",
        ),
        # leader at 0.8 m, from where the climb of -0.5 m/s ends over 2 s, which costs 0.5 m
        (
            (
                "start.position_m=[0, 0, 5.3]",
                "phases.3.duration_s=10",
                f"phases.3.motion={SINK}",
                "phases.4.motion={kind: hover, ramp_s: 2}",
            ),
            "E",
            "follower_1",
            "-0.200",
        ),
    ],
    ids=["leader", "follower", "sinking spiral", "turn that sinks", "hover that brakes"],
)
def test_way_into_the_ground(overrides: tuple[str, ...], phase: str, vehicle: str, height: str) -> None:
    """The paper's flight starts at 2 m, with all followers at the leader's height or below."""
    line = problem_of(*overrides)
    assert line.endswith(
        f"phase '{phase}' takes {vehicle} to {height} m above ground, more than 0 m are needed: "
        "start higher, or descend less"
    )
