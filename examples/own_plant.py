#!/usr/bin/env python3
"""A plant of your own: relform's estimator and controller fly vehicles that relform does not simulate.

`.venv/bin/python examples/own_plant.py` flies a circle with drag that grows with the square of the speed.
"""

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from relform_controller.formation_controller import FormationController
from relform_core.arrays import Array
from relform_core.load import load_scenario
from relform_core.measurements import Odometry, TeamMeasurements
from relform_core.randomness import Streams
from relform_core.units import GRAVITY
from relform_core.vehicle_config import VehicleConfig
from relform_sensors.suite import SensorSuite

SUBSTEPS = 10
DRAG_N_S2_M2 = 0.05
"""Force over the square of the speed."""


class OwnPlant:
    """One quadrotor: replace it by your simulator, or by a vehicle that reports what `odometry` returns."""

    def __init__(self, vehicle: VehicleConfig, p_NB_N: Array) -> None:
        """At rest at a place [m], shape (3,)."""
        self._vehicle = vehicle
        self._p_NB_N, self._v_NB_N, self._w_NB_B = p_NB_N, np.zeros(3), np.zeros(3)
        self._attitude = Rotation.identity()
        self.f_NB_B = np.array([0.0, 0.0, GRAVITY])
        """Specific force, which accelerometers measure [m/s^2], shape (3,)."""

    def step(self, speeds: Array, duration: float) -> None:
        """Fly with rotor speeds front, left, back, right [rad/s] for some time [s]."""
        inertia, arm = np.array(self._vehicle.inertia), self._vehicle.arm_length
        thrusts = self._vehicle.thrust_coefficient * speeds**2
        front, left, back, right = thrusts
        yaw_per_thrust = self._vehicle.torque_coefficient / self._vehicle.thrust_coefficient
        torque_B = np.array(
            [arm * (left - right), arm * (back - front), yaw_per_thrust * (front - left + back - right)]
        )
        dt = duration / SUBSTEPS
        for _ in range(SUBSTEPS):  # semi-implicit Euler
            gyroscopic = np.cross(self._w_NB_B, inertia * self._w_NB_B)
            self._w_NB_B = self._w_NB_B + dt * (torque_B - gyroscopic) / inertia
            self._attitude = self._attitude * Rotation.from_rotvec(dt * self._w_NB_B)
            v_NB_B = self._attitude.inv().apply(self._v_NB_N)
            drag_B = -DRAG_N_S2_M2 * np.linalg.norm(v_NB_B) * v_NB_B
            self.f_NB_B = (np.array([0.0, 0.0, thrusts.sum()]) + drag_B) / self._vehicle.mass
            a_NB_N = self._attitude.apply(self.f_NB_B) - np.array([0.0, 0.0, GRAVITY])
            self._v_NB_N = self._v_NB_N + dt * a_NB_N
            self._p_NB_N = self._p_NB_N + dt * self._v_NB_N

    def odometry(self, stamp_ns: int) -> Odometry:
        """The true state at an instant [ns]."""
        v_NB_B = self._attitude.inv().apply(self._v_NB_N)
        exact = np.zeros((6, 6))
        return Odometry(stamp_ns, self._p_NB_N, self._attitude.as_quat(), v_NB_B, self._w_NB_B, exact, exact)


def fly() -> Mapping[str, Odometry]:
    """Fly the scenario `circle` and return the last true states, by vehicle."""
    scenario = load_scenario("circle", seed=1)
    config = scenario.config
    plants = {name: OwnPlant(config.vehicle, np.array(at)) for name, at in config.start_places.items()}
    sensors = {
        name: SensorSuite(config, name, Streams(scenario.seed, index)) for index, name in enumerate(plants)
    }
    controller = FormationController(config)
    for step in range(config.n_steps):
        stamp_ns = step * config.period_ns
        truth = {name: plant.odometry(stamp_ns) for name, plant in plants.items()}
        measured = {name: sensors[name].read(truth, plant.f_NB_B) for name, plant in plants.items()}
        decision = controller.step(TeamMeasurements(step, stamp_ns, measured))
        for name, plant in plants.items():
            plant.step(decision.commands[name].speeds, config.controller.period)
    return truth


def main() -> None:
    """Fly and print where the vehicles are in the end."""
    for name, state in fly().items():
        print(f"{name} ends at {state.p_NB_N.round(2)} m")


if __name__ == "__main__":
    main()
