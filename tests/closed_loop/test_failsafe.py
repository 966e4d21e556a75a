"""The failsafe flies the true vehicle on its own sensors from a bad start to a slow level descent."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_core.load import load_scenario
from relform_core.measurements import RotorCommand
from relform_sensors.imu import ImuSensor
from relform_sensors.optic_flow import OpticFlowSensor
from relform_sensors.sonar import SonarSensor
from relform_sim.onboard import Onboard
from relform_sim.pilot import Readings
from relform_sim.plant import Plant
from relform_sim.rigid_body import draw_body

CONFIG = load_scenario(Path(__file__).parents[2] / "config/scenarios/paper.yaml").config
SECONDS = 10.0


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(
    ("tilt_deg", "rates_deg_s", "rotor_time_constant", "thrust_scale"),
    [
        (20.0, (40.0, -60.0, 90.0), 0.0, 1.0),
        (20.0, (-80.0, 30.0, -50.0), 0.03, 1.0),
        (20.0, (40.0, -60.0, 90.0), 0.0, 0.9),
        (60.0, (100.0, 100.0, 0.0), 0.0, 1.0),
    ],
)
def test_levels_and_sinks_slowly(
    tilt_deg: float,
    rates_deg_s: tuple[float, float, float],
    rotor_time_constant: float,
    thrust_scale: float,
    seed: int,
) -> None:
    tilt_axis = np.array([0.6, -0.8, 0.0])
    attitude = Rotation.from_rotvec(math.radians(tilt_deg) * tilt_axis) * Rotation.from_euler("z", 2.0)
    generator = np.random.default_rng(seed)
    plant = Plant(
        draw_body(CONFIG.vehicle, generator),
        step=CONFIG.plant.step,
        rotor_time_constant=rotor_time_constant,
        rotor_speed=CONFIG.vehicle.hover_speed,
        p_NB_N=(3.0, -1.0, 20.0),
        q_NB=tuple(attitude.as_quat().tolist()),
        v_NB_N=(1.0, -2.0, 0.7),
        w_NB_B=tuple(np.radians(rates_deg_s).tolist()),
    )
    imu = ImuSensor(CONFIG.sensors.imu, generator, yaw_is_known=False)
    optic_flow = OpticFlowSensor(CONFIG.sensors.optic_flow, generator)
    sonar = SonarSensor(CONFIG.sensors.sonar, np.random.default_rng(seed))
    onboard = Onboard(CONFIG.vehicle, CONFIG.controller.period)
    hover = np.full(4, CONFIG.vehicle.hover_speed)
    expired = RotorCommand(-CONFIG.period_ns, CONFIG.period_ns, hover, predicted_speeds=np.zeros((0, 4)))

    tilts, climbs, yaw_rates = [], [], []
    n_steps = round(SECONDS / CONFIG.controller.period)
    for step in range(n_steps):
        stamp_ns = step * CONFIG.period_ns
        truth = plant.odometry(stamp_ns)
        R_NB = Rotation.from_quat(truth.q_NB)
        tilts.append(math.degrees(math.acos(min(1.0, R_NB.as_matrix()[2, 2]))))
        climbs.append(R_NB.apply(truth.v_NB_B)[2])
        yaw_rates.append(math.degrees(truth.w_NB_B[2]))
        commands = [expired] if step == 0 else []
        readings = Readings(
            imu.read(truth, plant.specific_force()), optic_flow.read(truth), sonar.read(truth)
        )
        speeds = onboard.rotor_speeds(stamp_ns, commands, readings)
        plant.advance(tuple(speeds.tolist()), CONFIG.controller.period, thrust_scale=thrust_scale)

    settled, steady = round(2.0 / CONFIG.controller.period), round(4.0 / CONFIG.controller.period)
    assert onboard.counts.failsafe == n_steps
    assert max(tilts) < tilt_deg + 15.0
    assert max(tilts[settled:]) < 2.0
    assert max(map(abs, yaw_rates[settled:])) < 12.0  # what the noise of the gyro leaves
    # A thrust that is 10% short costs 1 m/s^2, which the proportional descent answers with another 0.33 m/s.
    descent_speed = CONFIG.vehicle.failsafe.descent_speed
    assert -descent_speed - 0.45 < np.mean(climbs[steady:]) < -descent_speed + 0.1
    assert min(climbs[steady:]) > -1.0
    assert max(climbs[steady:]) < -0.1
