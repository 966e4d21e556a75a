"""The leader's reference: smooth, consistent, and as the phases define it."""

import math

import numpy as np
import pytest

from relform_controller.reference.trajectory import LeaderReference, LeaderTrajectory
from relform_core.scenario_config import ScenarioConfig
from support.scenarios import paper_scenario

FINE = 0.005
"""Control period for differences [s]."""
START = ("start.position_m=[3, -4, 2.5]", "start.yaw_deg=30")
N_EXTRA = 15


def config_with(*overrides: str, period: float = FINE) -> ScenarioConfig:
    return paper_scenario(*START, f"controller.period_s={period}", *overrides).config


def whole(config: ScenarioConfig) -> LeaderReference:
    stamps_ns = np.arange(config.n_steps + 1 + N_EXTRA) * config.period_ns
    return LeaderTrajectory(config, N_EXTRA).at(stamps_ns)


def phases(*phases: tuple[float, str]) -> str:
    """Override: phases of a duration [s] and a motion."""
    items = [
        f"{{name: P{i}, title: T, duration_s: {s}, steady_from_s: 0, formation: initial, motion: {motion}}}"
        for i, (s, motion) in enumerate(phases)
    ]
    return f"phases=[{', '.join(items)}]"


PAPER = whole(config_with())


def at(reference: LeaderReference, time: float) -> tuple[np.ndarray, np.ndarray, float]:
    index = round(time / FINE)
    return reference.p_NB_N[index], reference.v_NB_N[index], float(reference.yaw_NB[index])


AWKWARD = (
    (1.5, "{kind: straight, speed_m_s: 2.0, ramp_s: 4.0}"),  # not reached before the next phase
    (2.0, "{kind: spiral, radius_m: -1.5, speed_m_s: 1.2, climb_m_s: -0.3, ramp_s: 0.8}"),
    (1.0, "{kind: turn, angle_deg: -200.0, turn_s: 1.5}"),  # nor this angle
    (2.0, "{kind: hover, ramp_s: 1.2}"),
    (1.0, "{kind: straight, speed_m_s: 0.5, ramp_s: 0.5}"),
)


@pytest.mark.parametrize("overrides", [(), (phases(*AWKWARD),)], ids=["paper", "awkward"])
def test_velocity_is_the_derivative_of_position_and_lies_along_the_heading(
    overrides: tuple[str, ...],
) -> None:
    reference = whole(config_with(*overrides))
    p, v, yaw = reference.p_NB_N, reference.v_NB_N, reference.yaw_NB
    np.testing.assert_allclose((p[2:] - p[:-2]) / (2 * FINE), v[1:-1], atol=1e-3)
    across = -np.sin(yaw) * v[:, 0] + np.cos(yaw) * v[:, 1]
    np.testing.assert_allclose(across, 0.0, atol=1e-12)
    assert (np.cos(yaw) * v[:, 0] + np.sin(yaw) * v[:, 1] > -1e-12).all()  # forwards


@pytest.mark.parametrize("overrides", [(), (phases(*AWKWARD),)], ids=["paper", "awkward"])
def test_reference_is_smooth(overrides: tuple[str, ...]) -> None:
    reference = whole(config_with(*overrides))
    assert np.abs(np.diff(reference.p_NB_N, axis=0)).max() < 2.1 * FINE
    assert np.abs(np.diff(reference.v_NB_N, axis=0)).max() < 12.0 * FINE  # the agile turn takes 10 m/s^2
    assert np.abs(np.diff(reference.yaw_NB)).max() < 8.0 * FINE


def test_starts_at_rest_at_the_configured_place() -> None:
    p, v, yaw = at(PAPER, 0.0)
    np.testing.assert_array_equal(p, [3.0, -4.0, 2.5])
    np.testing.assert_array_equal(v, np.zeros(3))
    assert yaw == pytest.approx(math.radians(30.0))
    np.testing.assert_allclose(at(PAPER, 1.0)[0], p, atol=1e-12)


def test_straight_line_reaches_its_speed_and_flies_along_the_heading() -> None:
    p_2, v, _ = at(PAPER, 1.0 + 1.5)
    ahead = np.array([math.cos(math.radians(30.0)), 0.5, 0.0])
    np.testing.assert_allclose(v, 2.0 * ahead, atol=1e-9)
    np.testing.assert_allclose(
        p_2 - PAPER.p_NB_N[0], 1.5 * ahead, atol=1e-3
    )  # the mean speed of the ramp is 1 m/s
    np.testing.assert_allclose(at(PAPER, 6.0)[0] - p_2, 7.0 * ahead, atol=1e-3)


def test_turn_takes_its_time_at_constant_speed() -> None:
    assert at(PAPER, 6.0)[2] == pytest.approx(math.radians(30.0))
    assert at(PAPER, 6.25)[2] == pytest.approx(math.radians(75.0), abs=1e-6)
    assert at(PAPER, 6.5)[2] == pytest.approx(math.radians(120.0), abs=1e-6)
    assert at(PAPER, 11.0)[2] == pytest.approx(math.radians(120.0), abs=1e-6)
    turning = PAPER.v_NB_N[round(6.0 / FINE) : round(11.0 / FINE)]
    np.testing.assert_allclose(np.linalg.norm(turning, axis=1), 2.0, atol=1e-9)


@pytest.mark.parametrize(("radius", "climb"), [(2.0, 0.4), (-3.0, -0.2)])
def test_spiral_has_its_radius_climb_and_speed(radius: float, climb: float) -> None:
    spiral = f"{{kind: spiral, radius_m: {radius}, speed_m_s: 1.9, climb_m_s: {climb}, ramp_s: 1.0}}"
    reference = whole(config_with(phases((12.0, spiral)), "start.position_m=[3, -4, 9]"))
    steady = slice(round(1.0 / FINE), round(12.0 / FINE))
    x, y, z = reference.p_NB_N[steady].T
    # Circle by least squares: x^2 + y^2 = 2 a x + 2 b y + c
    a, b, c = np.linalg.lstsq(np.stack([2 * x, 2 * y, np.ones_like(x)], axis=1), x**2 + y**2)[0]
    assert math.sqrt(c + a**2 + b**2) == pytest.approx(abs(radius), abs=1e-4)
    assert np.ptp(np.hypot(x - a, y - b)) < 1e-4
    assert np.polyfit(np.arange(z.size) * FINE, z, 1)[0] == pytest.approx(climb, abs=1e-6)
    np.testing.assert_allclose(np.linalg.norm(reference.v_NB_N[steady], axis=1), 1.9, atol=1e-9)
    # To the left for a positive radius, and on and on: the yaw is not wrapped.
    turned = np.diff(reference.yaw_NB[steady])
    assert (np.sign(turned) == np.sign(radius)).all()
    assert abs(reference.yaw_NB[-1] - reference.yaw_NB[0]) > math.tau


def test_hover_comes_to_rest_and_stays_with_its_yaw() -> None:
    straight = "{kind: straight, speed_m_s: 1.5, ramp_s: 1.0}"
    motions = ((2.0, straight), (3.0, "{kind: hover, ramp_s: 1.0}"))
    reference = whole(config_with(phases(*motions)))
    stopped = round(3.0 / FINE)
    np.testing.assert_allclose(reference.v_NB_N[stopped:], 0.0, atol=1e-12)
    assert np.ptp(reference.p_NB_N[stopped:], axis=0).max() < 1e-9
    # 0.75 m in each ramp, 1.5 m between them
    assert np.linalg.norm(reference.p_NB_N[-1] - reference.p_NB_N[0]) == pytest.approx(3.0, abs=1e-3)


def test_last_motion_continues_after_the_end() -> None:
    after = PAPER.v_NB_N[-N_EXTRA:]
    np.testing.assert_allclose(np.linalg.norm(after, axis=1), 1.9, atol=1e-9)
    assert np.diff(PAPER.yaw_NB[-N_EXTRA:]).min() > 0.9 * FINE * 1.857 / 2.0


def test_reference_does_not_depend_on_the_control_period() -> None:
    coarse = whole(config_with(period=0.05))
    n = len(coarse.yaw_NB) - N_EXTRA
    np.testing.assert_allclose(coarse.p_NB_N[:n], PAPER.p_NB_N[::10][:n], atol=1e-3)
    np.testing.assert_allclose(coarse.v_NB_N[:n], PAPER.v_NB_N[::10][:n], atol=1e-3)
    np.testing.assert_allclose(coarse.yaw_NB[:n], PAPER.yaw_NB[::10][:n], atol=1e-3)


def test_a_window_equals_a_part_of_the_whole() -> None:
    config = config_with(period=0.05)
    reference = whole(config)
    window = LeaderTrajectory(config, N_EXTRA).at(np.arange(137, 153) * config.period_ns)
    np.testing.assert_array_equal(window.p_NB_N, reference.p_NB_N[137:153])
    np.testing.assert_array_equal(window.v_NB_N, reference.v_NB_N[137:153])
    np.testing.assert_array_equal(window.yaw_NB, reference.yaw_NB[137:153])


def test_instants_between_control_steps() -> None:
    """At a tenth of the control period the reference equals that of a finer control period."""
    config = config_with(period=0.05)
    between = LeaderTrajectory(config, N_EXTRA).at(np.arange(10 * config.n_steps) * (config.period_ns // 10))
    n = 10 * config.n_steps
    np.testing.assert_allclose(between.p_NB_N, PAPER.p_NB_N[:n], atol=1e-3)
    np.testing.assert_allclose(between.v_NB_N, PAPER.v_NB_N[:n], atol=1e-3)
    np.testing.assert_allclose(between.yaw_NB, PAPER.yaw_NB[:n], atol=1e-3)


@pytest.mark.parametrize(
    ("first", "count", "asked"), [(540, 17, "27, 27.8"), (556, 1, "27.8, 27.8"), (-1, 3, "-0.05, 0.05")]
)
def test_a_window_outside_the_flight_is_an_error(first: int, count: int, asked: str) -> None:
    config = config_with(period=0.05)
    expected = rf"^the leader's reference is known from 0 to 27.75 s \(asked for {asked} s\)$"
    with pytest.raises(ValueError, match=expected):
        LeaderTrajectory(config, N_EXTRA).at(np.arange(first, first + count) * config.period_ns)
