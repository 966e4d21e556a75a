"""What is drawn of a flight with perfect sensors is where the vehicles are."""

from itertools import islice

import numpy as np
import pytest

from relform_analysis.flight.simulate import simulate
from relform_bringup.scene.path_ahead import PathAhead
from relform_bringup.scene.poses import estimated_poses, wanted_places
from relform_core.sensors.imu import IMU
from support.flights import seconds
from support.scenarios import NOISE_FREE, paper_scenario


def test_poses_of_a_flight_with_perfect_sensors_are_the_true_ones() -> None:
    scenario = paper_scenario(*NOISE_FREE, "start.yaw_deg=50", "start.position_m=[3.0, -2.0, 4.0]", seed=3)
    leader = scenario.config.team.leader
    ahead = PathAhead(scenario.config)
    tilt = 0.0
    for step in islice(simulate(scenario), seconds(scenario, 3.0)):
        assert step.decision is not None
        attitudes = {
            name: imu.q_NB
            for name, readings in step.measurements.by_vehicle.items()
            if (imu := readings.newest(IMU)) is not None
        }
        poses = estimated_poses(step.decision.state, attitudes, leader)
        assert poses.keys() == step.ground_truth.keys()
        for name, truth in step.ground_truth.items():
            assert poses[name].p_NB_N == pytest.approx(truth.p_NB_N, abs=1e-6)
            assert abs(poses[name].q_NB @ truth.q_NB) == pytest.approx(1.0, abs=1e-9)
            tilt = max(tilt, float(np.hypot(*truth.q_NB[:2])))
        places = wanted_places(step.decision.reference, leader)
        for name, truth in step.ground_truth.items():
            assert places[name].p_NB_N == pytest.approx(truth.p_NB_N, abs=0.15)
        assert ahead.after(step.decision.step, step.decision.reference, 100_000_000, 5)
    assert tilt > 0.05
