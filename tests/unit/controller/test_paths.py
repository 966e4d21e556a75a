"""Circle, figure eight, waypoints and recorded paths: their places, speeds and headings at known instants."""

import math

import numpy as np
import pytest

from relform_controller.reference.paths import circle, figure_eight, waypoints
from relform_controller.reference.trajectory import LeaderReference, LeaderTrajectory
from relform_core.paths_config import Circle, FigureEight, Waypoints
from support.scenarios import paper_scenario

PERIOD = 0.05
YAW = math.radians(30.0)
START = np.array([3.0, -4.0, 2.5])
CIRCLE = "{kind: circle, radius_m: -2.0, speed_m_s: 1.5, ramp_s: 1.2}"
EIGHT = "{kind: figure_eight, radius_m: 1.5, speed_m_s: 1.2, ramp_s: 1.0, turns: 2}"
COURSE = "{kind: waypoints, points_m: [[4, 0, 0], [4, -3, 1], [0, -3, 1]], speed_m_s: 1.5, ramp_s: 1.2}"


def flown(motion: str, duration: float) -> LeaderReference:
    """A hover of 1 s, then the motion, at each control step."""
    items = ", ".join(
        f"{{name: P{i}, title: T, duration_s: {s}, steady_from_s: 0, formation: initial, motion: {m}}}"
        for i, (s, m) in enumerate(((1.0, "{kind: hover, ramp_s: 0}"), (duration, motion)))
    )
    config = paper_scenario("start.position_m=[3, -4, 2.5]", "start.yaw_deg=30", f"phases=[{items}]").config
    return LeaderTrajectory(config, 0).at(np.arange(config.n_steps + 1) * config.period_ns)


def seen_from_start(reference: LeaderReference) -> np.ndarray:
    """Forward, left and up from the pose at the start [m], shape (step, 3)."""
    x, y, z = (reference.p_NB_N - START).T
    return np.stack(
        [math.cos(YAW) * x + math.sin(YAW) * y, -math.sin(YAW) * x + math.cos(YAW) * y, z], axis=1
    )


@pytest.mark.parametrize(
    ("motion", "duration", "end", "turned"),
    [
        (CIRCLE, 10.0, (0.0, 0.0, 0.0), -math.tau),
        (EIGHT, 40.0, (0.0, 0.0, 0.0), 0.0),
        (COURSE, 9.0, (0.0, -3.0, 1.0), -math.pi),
    ],
    ids=["circle", "figure eight", "waypoints"],
)
def test_path_starts_and_ends_at_rest_where_it_should(
    motion: str, duration: float, end: tuple[float, ...], turned: float
) -> None:
    reference = flown(motion, duration)
    places = seen_from_start(reference)
    np.testing.assert_allclose(places[:21], 0.0, atol=1e-12)  # the hover
    np.testing.assert_allclose(places[-1], end, atol=1e-5)
    np.testing.assert_allclose(reference.v_NB_N[[0, 20, -1]], 0.0, atol=1e-12)
    assert reference.yaw_NB[-1] - YAW == pytest.approx(turned, abs=1e-6)


def test_circle_keeps_its_radius_and_lies_on_the_right() -> None:
    """Half a circle after 2 pi / 1.5 + 0.6 s: the ramp costs half of its 1.2 s."""
    places = seen_from_start(flown(CIRCLE, 10.0))
    np.testing.assert_allclose(np.hypot(places[:, 0], places[:, 1] + 2.0), 2.0, atol=1e-5)
    half = round((1.0 + math.tau / 1.5 + 0.6) / PERIOD)
    np.testing.assert_allclose(places[half], [0.0, -4.0, 0.0], atol=0.05)


def test_circle_at_known_instants() -> None:
    motion = Circle.model_validate(
        {"kind": "circle", "radius_m": -2.0, "speed_m_s": 1.5, "ramp_s": 1.2, "turns": 3}
    )
    assert motion.time == pytest.approx(12.0 * math.pi / 1.5 + 1.2)
    times = np.array([0.0, 0.3, 0.6, 1.2, 9.0, motion.time - 0.3, motion.time, motion.time + 1.0])
    # smooth step: 3 x^2 - 2 x^3 at x = 0.25 is 0.15625
    speeds = 1.5 * np.array([0.0, 0.15625, 0.5, 1.0, 1.0, 0.15625, 0.0, 0.0])
    expected = np.stack([speeds, np.zeros(8), speeds / -2.0, np.zeros(8)])
    np.testing.assert_allclose(circle(motion, times), expected, atol=1e-12)


def test_figure_eight_at_known_instants() -> None:
    """Straight at the crossing, sharpest in the middle of each loop: to the left, then to the right."""
    motion = FigureEight.model_validate(
        {"kind": "figure_eight", "radius_m": 1.5, "speed_m_s": 1.2, "ramp_s": 1.0}
    )
    once = math.tau * 2.404825557695773 * 1.5  # 22.665 m
    assert motion.time == pytest.approx(once / 1.2 + 1.0)
    times = 0.5 + np.array([0.25, 0.5, 0.75]) * once / 1.2
    speed, climb, turn_rate, _ = figure_eight(motion, times)
    np.testing.assert_allclose(speed, 1.2, atol=1e-12)
    np.testing.assert_allclose(climb, 0.0)
    np.testing.assert_allclose(turn_rate, [1.2 / 1.5, 0.0, -1.2 / 1.5], atol=1e-12)


def test_figure_eight_crosses_itself_in_the_middle() -> None:
    """At half of its length it is at its start again, after turning left by 2 * 137.8 degrees."""
    single = EIGHT.replace(", turns: 2", "")
    reference = flown(single, 21.0)
    places = seen_from_start(reference)
    middle = (1.0 + 0.5 + 0.5 * math.tau * 2.404825557695773 * 1.5 / 1.2) / PERIOD
    at = [np.interp(middle, np.arange(len(places)), places[:, axis]) for axis in range(3)]
    np.testing.assert_allclose(at, 0.0, atol=2e-3)
    assert math.degrees(reference.yaw_NB.max() - YAW) == pytest.approx(275.57, abs=0.01)


def test_waypoints_at_known_instants() -> None:
    """Legs of 4, sqrt(10) and 4 m at 1.5 m/s, so the corners are in the middle at 0.6 + 4 / 1.5 s, and on."""
    motion = Waypoints.model_validate(
        {
            "kind": "waypoints",
            "points_m": ((4.0, 0.0, 0.0), (4.0, -3.0, 1.0), (0.0, -3.0, 1.0)),
            "speed_m_s": 1.5,
            "ramp_s": 1.2,
        }
    )
    assert motion.time == pytest.approx((8.0 + math.sqrt(10.0)) / 1.5 + 1.2)
    corner = 0.6 + 4.0 / 1.5
    slanted = 1.5 * np.array([0.0, -3.0, 1.0]) / math.sqrt(10.0)
    times = np.array([0.0, 2.0, corner, corner + 1.0, motion.time])
    speed, climb, turn_rate, _ = waypoints(motion, times)
    half = 0.5 * (np.array([1.5, 0.0, 0.0]) + slanted)
    np.testing.assert_allclose(speed, [0.0, 1.5, math.hypot(*half[:2]), -slanted[1], 0.0], atol=1e-12)
    np.testing.assert_allclose(climb, [0.0, 0.0, half[2], slanted[2], 0.0], atol=1e-12)
    # In the middle of the corner the acceleration is 1.5 / 1.2 times the change of velocity.
    a = 1.25 * (slanted - [1.5, 0.0, 0.0])
    expected = (half[0] * a[1] - half[1] * a[0]) / (half[0] ** 2 + half[1] ** 2)
    np.testing.assert_allclose(turn_rate, [0.0, 0.0, expected, 0.0, 0.0], atol=1e-12)


def test_waypoints_fly_along_their_legs_and_cut_corners() -> None:
    """Each corner is cut over 0.9 m on both sides; half-way the path passes at 0.1875 of the change."""
    places = seen_from_start(flown(COURSE, 9.0))
    on_first = places[places[:, 0] < 3.1][:60]
    np.testing.assert_allclose(on_first[:, 1:], 0.0, atol=1e-9)
    corner = 1.0 + 0.6 + 4.0 / 1.5
    at = [np.interp(corner / PERIOD, np.arange(len(places)), places[:, axis]) for axis in range(3)]
    # Integral of the smooth step up to its middle: 3/32 of the ramp.
    change = 1.5 * np.array([-1.0, -3.0 / math.sqrt(10.0), 1.0 / math.sqrt(10.0)])
    np.testing.assert_allclose(at, [4.0, 0.0, 0.0] + change * 1.2 * 3.0 / 32.0, atol=2e-3)


RECORDED = (
    "{kind: path, times_s: [5, 8, 11, 14], points_m: [[1, 1, 4], [1, 3, 4], [0, 3, 5], [0, 3, 4.5]], "
    "yaws_deg: [90, 170, -170, -100]}"
)


def test_recorded_path_is_moved_and_turned_to_the_pose_of_the_leader() -> None:
    """Its first sample is 90 degrees to the left of x, so its y is forward and its -x is to the left."""
    reference = flown(RECORDED, 10.0)
    places = seen_from_start(reference)
    at = [20, 80, 140, 200, 220]  # after 0, 3, 6, 9 and 10 s
    expected = [[0, 0, 0], [2, 0, 0], [2, 1, 1], [2, 1, 0.5], [2, 1, 0.5]]
    np.testing.assert_allclose(places[at], expected, atol=1e-5)
    turned = np.degrees(reference.yaw_NB[at] - YAW)
    np.testing.assert_allclose(turned, [0.0, 80.0, 100.0, 170.0, 170.0], atol=1e-4)
    np.testing.assert_allclose(reference.v_NB_N[[20, 200, 220]], 0.0, atol=1e-12)


def test_recorded_path_without_yaw_keeps_that_of_the_leader() -> None:
    """It may start in any direction, here to the right."""
    reference = flown("{kind: path, times_s: [0, 3], points_m: [[0, 0, 1], [0, -3, 1]]}", 4.0)
    np.testing.assert_allclose(reference.yaw_NB, YAW, atol=1e-12)
    places = seen_from_start(reference)
    np.testing.assert_allclose(places[[50, 80, 100]], [[0, -1.5, 0], [0, -3, 0], [0, -3, 0]], atol=1e-5)


def test_phase_after_a_recorded_path_starts_from_its_end() -> None:
    path = "{kind: path, times_s: [0, 3], points_m: [[0, 0, 1], [0, -3, 1]], yaws_deg: [0, 60]}"
    config = paper_scenario(
        "start.yaw_deg=30",
        *(f"phases.1.motion={path}", "phases.2.motion={kind: straight, speed_m_s: 2, ramp_s: 1}"),
    ).config
    reference = LeaderTrajectory(config, 0).at(np.array([6, 8]) * 10**9)
    np.testing.assert_allclose(reference.p_NB_N[0], [1.5, -1.5 * math.sqrt(3.0), 2.0], atol=1e-5)
    np.testing.assert_allclose(reference.p_NB_N[1] - reference.p_NB_N[0], [0.0, 3.0, 0.0], atol=1e-5)
