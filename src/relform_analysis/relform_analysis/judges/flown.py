"""A flight as a problem of estimation: true states, thrusts and measurements at every control step."""

from dataclasses import dataclass

import numpy as np

from relform_analysis.flight.simulate import SimulatedStep, simulate
from relform_controller.blas import one_blas_thread
from relform_controller.estimation import team_model
from relform_controller.estimation.team_belief import Observation
from relform_controller.estimation.team_observation import ObservationBuilder
from relform_controller.ocp import layout
from relform_controller.ocp.frames import rotation_CB, rotation_z, rpy_from_quaternion
from relform_core.arrays import Array
from relform_core.errors import RelformError
from relform_core.load import LoadedScenario
from relform_core.measurements import Odometry
from relform_core.sensors.sonar import SONAR
from relform_core.telemetry import TeamState


@dataclass(frozen=True, eq=False)
class FlownStep:
    """One control step."""

    states: Array
    """True states as in ``team_model``, undisturbed, with nominal thrust and inertia, shape
    (vehicle, 19)."""
    thrusts: Array
    """Nominal thrusts in the interval that starts here [N], shape (vehicle, 4)."""
    observation: Observation
    """What was measured at this instant."""
    estimate: TeamState
    """What the controller estimated."""


def fly(scenario: LoadedScenario) -> list[FlownStep]:
    """Fly a scenario.

    Raises:
        RelformError: links or rotors delay something, or the flight does not complete.
    """
    config = scenario.config
    if not config.links.are_perfect or config.true_vehicle.rotor_time_constant > 0.0:
        raise RelformError(
            f"{config.name}: only flights with perfect links and rotors without lag are judged"
        )
    builder = ObservationBuilder(config.team.vehicles, config.sensors.of(SONAR).range_std)
    steps = []
    with one_blas_thread():
        for step in simulate(scenario):
            if step.faults:
                raise RelformError(f"{config.name}: the flight did not complete: {step.faults}")
            if step.decision is None:
                continue
            speeds = np.array([step.decision.commands[name].speeds for name in config.team.vehicles])
            states = np.array([true_state(odometry) for odometry in step.ground_truth.values()])
            thrusts = config.vehicle.thrust_coefficient * speeds**2
            steps.append(FlownStep(states, thrusts, builder.build(_measured(step)), step.decision.state))
    return steps


def _measured(step: SimulatedStep) -> dict[tuple[str, str], object]:
    return {
        (name, sensor): measurement
        for name, vehicle in step.measurements.by_vehicle.items()
        for sensor, arrived in vehicle.by_sensor.items()
        for measurement in arrived
    }


def true_state(odometry: Odometry) -> Array:
    """The state of ``team_model`` of a vehicle, undisturbed and nominal, shape (19,)."""
    state = np.zeros(team_model.N_FILTER_STATE)
    state[layout.POSITION] = odometry.p_NB_N
    state[layout.RPY] = rpy_from_quaternion(odometry.q_NB)
    roll, pitch, yaw = state[layout.RPY].tolist()
    state[layout.VELOCITY] = rotation_z(yaw) @ rotation_CB(roll, pitch) @ odometry.v_NB_B
    state[layout.RATE] = odometry.w_NB_B
    state[team_model.THRUST_SCALE] = 1.0
    state[team_model.INERTIA_SCALE] = 1.0
    return state
