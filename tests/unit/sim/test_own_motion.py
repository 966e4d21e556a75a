"""The motion of a vehicle by its own sensors: against the truth, and what each sensor tells."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_core.sensors.imu import Imu
from relform_core.sensors.optic_flow import OpticFlow
from relform_core.sensors.range_bearing import RangeBearing
from relform_core.sensors.sonar import Sonar
from relform_core.units import GRAVITY
from relform_sim.own_motion import OwnMotion
from relform_sim.pilot import Readings

PERIOD = 0.05
ATTITUDE = Rotation.from_euler("ZYX", [2.0, 0.2, -0.1])
FLOW_STD, SONAR_MIN = 0.25, 0.2


def readings(
    v_N: Any, a_N: Any, height: float, generator: np.random.Generator | None = None, **more: Any
) -> Readings:
    """What is measured at a constant attitude, with noise or without."""
    noise = np.zeros(7) if generator is None else generator.standard_normal(7)
    force_B = ATTITUDE.inv().apply(np.array(a_N) + [0.0, 0.0, GRAVITY]) + 0.05 * noise[:3]
    flow_B = ATTITUDE.inv().apply(v_N) + FLOW_STD * noise[3:6]
    measured = height + 0.02 * noise[6]
    eye = np.eye(3)
    return Readings(
        Imu(0, ATTITUDE.as_quat(), eye, np.zeros(3), eye, force_B, 0.05**2 * eye),
        OpticFlow(0, flow_B, FLOW_STD**2 * eye),
        Sonar(0, measured if measured >= SONAR_MIN else -math.inf, SONAR_MIN, 10.0, 0.5),
        **more,
    )


def moved(motion: OwnMotion, measured: Readings, steps: int = 1, *, has_landmarks: bool = False) -> None:
    for _ in range(steps):
        motion.move(measured, is_agile=False, has_landmarks=has_landmarks)


@pytest.mark.parametrize("seed", range(5))
def test_a_climb_is_known_within_the_noise_of_the_sensors(seed: int) -> None:
    """5 s of known acceleration: flow and accelerometer leave 6 cm of place, and the sonar 1 cm of height."""
    generator = np.random.default_rng(seed)
    motion = OwnMotion(PERIOD, 0.1, 1.7)
    motion.rest(readings(np.zeros(3), np.zeros(3), 0.1))
    p, v = np.array([0.0, 0.0, 0.1]), np.zeros(3)
    for step in range(100):
        a = np.array([0.5, -0.3, 0.4]) * math.cos(2.0 * PERIOD * (step + 0.5))
        p, v = p + PERIOD * (v + 0.5 * PERIOD * a), v + PERIOD * a
        moved(motion, readings(v, a, p[2], generator))
    assert np.abs(motion.v_N - v).max() < 3.5 * 0.035
    assert np.abs(motion.p_N[:2] - p[:2]).max() < 3.5 * 0.075
    assert abs(motion.p_N[2] - p[2]) < 3.5 * 0.01


def test_exact_readings_give_the_exact_motion() -> None:
    motion = OwnMotion(PERIOD, 0.5, 1.7)
    motion.rest(readings(np.zeros(3), np.zeros(3), 0.5))
    a = np.array([0.2, -0.1, 0.3])
    for step in range(1, 21):
        time = step * PERIOD
        moved(motion, readings(a * time, a, 0.5 + 0.5 * a[2] * time**2))
    assert motion.v_N == pytest.approx(a)
    assert motion.p_N == pytest.approx([0.0, 0.0, 0.5] + 0.5 * a)


def test_no_range_says_that_the_vehicle_is_low_but_not_below_the_ground() -> None:
    motion = OwnMotion(PERIOD, 0.1, 1.7)
    motion.rest(readings(np.zeros(3), np.zeros(3), 0.1))
    moved(motion, readings([0.0, 0.0, 0.5], [0.0, 0.0, 0.0], 0.1), steps=60)  # climbs, by the flow alone
    assert motion.p_N[2] < SONAR_MIN + 0.05
    moved(motion, readings([0.0, 0.0, -0.5], [0.0, 0.0, 0.0], 0.1), steps=60)
    assert motion.p_N[2] > 0.1 - 0.05


def test_a_vehicle_that_starts_in_the_air_knows_its_height() -> None:
    seen, unseen = OwnMotion(PERIOD, 0.1, 1.7), OwnMotion(PERIOD, 0.1, 1.7)
    moved(seen, readings(np.zeros(3), np.zeros(3), 2.3))
    moved(unseen, readings(np.zeros(3), np.zeros(3), math.inf))
    assert (seen.p_N[2], unseen.p_N[2]) == pytest.approx((2.3, 1.7))


def sight(p_B: Any) -> RangeBearing:
    x, y, z = p_B
    return RangeBearing(
        "leader", math.hypot(x, y, z), math.atan2(y, x), math.atan2(z, math.hypot(x, y)), np.eye(3)
    )


def sees(relative_N: Any) -> dict[str, RangeBearing]:
    return {"leader": sight(ATTITUDE.inv().apply(relative_N))}


@pytest.mark.parametrize("kind", ["sight", "localization"])
def test_a_landmark_tells_how_far_the_vehicle_has_drifted(kind: str) -> None:
    """It stood at (5, 6), 1 m beside its leader, and is 0.2 m farther along x, unseen by its flow."""

    def at(x: float) -> Readings:
        more: dict[str, Any] = {"sights": sees([1.0 - x, 0.5, 0.3])}
        if kind == "localization":
            more = {"place_N": np.array([5.0 + x, 6.0, 0.1])}
        return readings(np.zeros(3), np.zeros(3), 0.1, **more)

    motion = OwnMotion(PERIOD, 0.1, 1.7)
    motion.rest(at(0.0))
    moved(motion, at(0.2), steps=200, has_landmarks=True)
    assert motion.p_N[:2] == pytest.approx([0.2, 0.0], abs=0.03)


def test_a_landmark_that_moves_away_is_ignored() -> None:
    motion = OwnMotion(PERIOD, 0.1, 1.7)
    motion.rest(readings(np.zeros(3), np.zeros(3), 0.1, sights=sees([1.0, 0.5, 0.3])))
    gone = readings(np.zeros(3), np.zeros(3), 0.1, sights=sees([1.5, 0.5, 0.3]))
    moved(motion, gone, steps=100, has_landmarks=True)
    assert motion.p_N[:2] == pytest.approx([0.0, 0.0], abs=1e-6)


def test_landmarks_are_found_again_after_the_team_has_moved() -> None:
    """They are where they are when the team stops, whatever the estimated place has become."""
    motion = OwnMotion(PERIOD, 0.1, 1.7)
    motion.rest(readings(np.zeros(3), np.zeros(3), 0.1, sights=sees([1.0, 0.5, 0.3])))
    elsewhere = readings(np.zeros(3), np.zeros(3), 2.0, sights=sees([-2.0, 1.0, 0.3]))
    moved(motion, elsewhere, has_landmarks=False)
    place = motion.p_N[:2]
    moved(motion, elsewhere, steps=20, has_landmarks=True)
    assert motion.p_N[:2] == pytest.approx(place, abs=1e-6)
