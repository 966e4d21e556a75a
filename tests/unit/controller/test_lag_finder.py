"""The lag of the rotors, found from how plants with a lag turn."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_controller.estimation.lag_finder import LagEvidence, LagFinder
from relform_controller.ocp.model import RigidBody
from relform_controller.ocp.rotor_lag import RotorLag
from relform_sim.plant import Plant
from relform_sim.rigid_body import draw_body
from support.scenarios import paper_scenario

VEHICLE = paper_scenario().config.vehicle
PERIOD = 0.05
STD = np.radians(0.005)
"""Of the attitude in the paper's IMU [rad]."""


class Team:
    """Two plants with uncertain inertia that hover with noise in their commands, and a finder."""

    def __init__(self, true: float, configured: float, seed: int, thrust_std: float = 0.1) -> None:
        self.generator = np.random.default_rng(seed)
        self.finder = LagFinder(RigidBody.from_config(VEHICLE), configured)
        self.evidence: LagEvidence = self.finder.start(np.full((2, 4), VEHICLE.hover_thrust))
        self._thrust_std = thrust_std
        self._plants = [
            Plant(
                dataclasses.replace(draw_body(VEHICLE, self.generator), mass=VEHICLE.mass),
                step=0.005,
                rotor_time_constant=true,
                rotor_speed=VEHICLE.hover_speed,
                p_NB_N=(0.0, 0.0, 10.0),
                q_NB=tuple(Rotation.from_euler("ZYX", [2.0, 0.2, -0.1]).as_quat().tolist()),
                w_NB_B=(0.1, -0.2, 0.8),
            )
            for _ in range(2)
        ]

    def fly(self, steps: int, probability: float = 1.0, outliers: float = 0.0) -> None:
        """With attitudes measured by chance, and some of them wrong by 5 deg."""
        for _ in range(steps):
            commands = VEHICLE.hover_thrust + self._thrust_std * self.generator.standard_normal((2, 4))
            self.evidence = self.finder.commanded(self.evidence, commands, PERIOD)
            for plant, thrusts in zip(self._plants, commands, strict=True):
                plant.advance(tuple(np.sqrt(thrusts / VEHICLE.thrust_coefficient).tolist()), PERIOD)
            measured = np.flatnonzero(self.generator.random(2) < probability)
            if measured.size:
                q_NB = np.array([self._attitude(vehicle, outliers) for vehicle in measured])
                variances = np.full(measured.size, STD**2)
                self.evidence = self.finder.measured(self.evidence, measured.tolist(), q_NB, variances)

    def _attitude(self, vehicle: int, outliers: float) -> np.ndarray:
        std = np.radians(5.0) if self.generator.random() < outliers else STD
        error = Rotation.from_rotvec(std * self.generator.standard_normal(3))
        turned = error * Rotation.from_quat(self._plants[vehicle].odometry(0).q_NB)
        return np.asarray(turned.as_quat()) * self.generator.choice([-1.0, 1.0])  # the same attitude


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("true", "configured"), [(0.05, 0.0), (0.03, 0.0), (0.0, 0.05)])
def test_another_lag_than_configured_is_found_within_a_second(
    true: float, configured: float, seed: int
) -> None:
    team = Team(true, configured, seed)
    assert team.evidence.lag == RotorLag(configured)
    team.fly(20)
    assert team.evidence.lag == RotorLag(true)
    team.fly(200)
    assert team.evidence.is_decided
    assert team.evidence.lag == RotorLag(true)


@pytest.mark.parametrize("seed", range(3))
def test_the_configured_lag_is_kept_if_it_is_right(seed: int) -> None:
    team = Team(true=0.045, configured=0.045, seed=seed)
    for _ in range(100):
        team.fly(1)
        assert team.evidence.lag == RotorLag(0.045)


def test_lost_attitudes_and_outliers_do_not_mislead() -> None:
    team = Team(true=0.04, configured=0.0, seed=4)
    team.fly(60, probability=0.6, outliers=0.1)
    assert team.evidence.lag == RotorLag(0.04)


def test_thrusts_are_those_of_the_candidate() -> None:
    """They go on following the commands when only one candidate is left."""
    team = Team(true=0.05, configured=0.05, seed=5)
    thrusts = np.full((2, 4), VEHICLE.hover_thrust)
    for step in range(300):
        commands = VEHICLE.hover_thrust + 0.1 * np.random.default_rng(step).standard_normal((2, 4))
        thrusts = RotorLag(0.05).after(thrusts, commands, PERIOD)
        team.evidence = team.finder.commanded(team.evidence, commands, PERIOD)
        np.testing.assert_array_equal(team.evidence.thrusts[team.evidence.best], thrusts)
        if step == 150:
            disfavour = -100.0 * np.abs(team.evidence.time_constants - 0.05) / 0.01
            team.evidence = dataclasses.replace(team.evidence, log_likelihoods=disfavour)
            level = np.array([[0.0, 0.0, 0.0, 1.0]])
            team.evidence = team.finder.measured(team.evidence, [0], level, np.array([STD**2]))
            assert team.evidence.is_decided


def test_a_team_at_rest_tells_nothing() -> None:
    """Without changes of thrust every candidate predicts the same."""
    team = Team(true=0.05, configured=0.02, seed=6, thrust_std=0.0)
    team.fly(40)
    assert not team.evidence.is_decided
    assert team.evidence.lag == RotorLag(0.02)
