"""The team's model of motion and measurements, linearised about given states, as whole matrices."""

import casadi as ca
import numpy as np
from scipy.linalg import block_diag

from relform_analysis.flight.tracking_errors import relative_positions
from relform_controller.estimation import team_model
from relform_controller.estimation.team_belief import Observation
from relform_controller.estimation.team_model import N_FILTER_STATE
from relform_controller.ocp import layout
from relform_controller.ocp.frames import rotation_z, wrap_angles
from relform_controller.ocp.model import RigidBody
from relform_core.arrays import Array
from relform_core.telemetry import TeamState


class LinearisedTeam:
    """Jacobians of the CasADi functions in ``team_model``, evaluated without the filter's compiled kernels.

    Args:
        body: the nominal body of every vehicle.
        n_vehicles: number of vehicles.
        period: between two instants [s].
    """

    def __init__(self, body: RigidBody, n_vehicles: int, period: float) -> None:
        self._n = n_vehicles
        self._period = period
        self._pairs = layout.ordered_pairs(n_vehicles)
        self._transition = team_model.transition(body)
        self._own = team_model.own_measurement(body)
        self._sighting = team_model.sighting()

    def motion(self, states: Array, thrusts: Array) -> tuple[Array, Array]:
        """States one period later, shape (vehicle, 19), and their Jacobian F, shape (19 n, 19 n)."""
        moved = [
            _numbers(self._transition(state, each, self._period))
            for state, each in zip(states, thrusts, strict=True)
        ]
        return np.array([following[:, 0] for following, _ in moved]), block_diag(*(F for _, F in moved))

    def measurement(self, states: Array, thrusts: Array, observation: Observation) -> tuple[Array, Array]:
        """Whitened residuals of what was measured, shape (m,), and their Jacobian W, shape (m, 19 n).

        Args:
            thrusts: in the interval that ends at this instant [N], shape (vehicle, 4).
        """
        residuals, rows = [], []
        for vehicle, (state, each) in enumerate(zip(states, thrusts, strict=True)):
            expected, H = _numbers(self._own(state, each))
            difference = observation.own[vehicle] - expected[:, 0]
            angular = team_model.ANGULAR_ROWS
            difference[angular] = wrap_angles(difference[angular])
            weights = observation.own_weights[vehicle]
            residuals.append(weights * difference)
            rows.append(self._row({vehicle: weights[:, None] * H}, len(weights)))
        for pair, (i, j) in enumerate(self._pairs):
            weights = observation.sighting_weights[pair]
            if not weights.any():
                continue
            expected, H_observer, H_target = _numbers(self._sighting(states[i], states[j]))
            difference = observation.sightings[pair] - expected[:, 0]
            difference[1:] = wrap_angles(difference[1:])
            residuals.append(weights @ difference)
            rows.append(self._row({i: weights @ H_observer, j: weights @ H_target}, len(difference)))
        residual, W = np.concatenate(residuals), np.concatenate(rows)
        measured = W.any(axis=1)
        return residual[measured], W[measured]

    def _row(self, blocks: dict[int, Array], height: int) -> Array:
        row = np.zeros((height, self._n, N_FILTER_STATE))
        for vehicle, block in blocks.items():
            row[:, vehicle] = block
        return row.reshape(height, -1)


def pair_position_jacobian(states: Array, i: int, j: int) -> Array:
    """Jacobian of p_B1B2_C1, the position of j in {mc_i}, by the states of the team; shape (3, 19 n)."""
    R_CN = rotation_z(-float(states[i, layout.YAW]))
    x, y, _ = R_CN @ (states[j, layout.POSITION] - states[i, layout.POSITION])
    jacobian = np.zeros((3, *states.shape))
    jacobian[:, j, layout.POSITION] = R_CN
    jacobian[:, i, layout.POSITION] = -R_CN
    jacobian[:, i, layout.YAW] = y, -x, 0.0
    return jacobian.reshape(3, -1)


def pair_positions(states: Array) -> Array:
    """p_B1B2_C1 of each ordered pair: the position of j in {mc_i} [m], shape (pair, 3)."""
    p_BB_C = relative_positions(states[:, layout.POSITION], states[:, layout.YAW])
    return np.array([p_BB_C[pair] for pair in layout.ordered_pairs(len(states))])


def pair_errors(estimate: TeamState, states: Array) -> Array:
    """Estimated minus true position of each ordered pair in {mc_i} [m], shape (pair, 3)."""
    estimated = np.array([pair.p_B1B2_C1__est for pair in estimate.pairs])
    return np.asarray(estimated - pair_positions(states))


def _numbers(outputs: tuple[ca.DM, ...]) -> list[Array]:
    return [np.array(each) for each in outputs]
