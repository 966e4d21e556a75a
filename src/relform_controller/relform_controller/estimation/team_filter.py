"""Square-root Kalman filter of the whole team, free of sensors and time stamps.

All vehicles share one state in the world frame {n} and one covariance with all cross terms. Relative
quantities stay accurate while the absolute ones drift together, so the formation does not depend on the
leader's localization. A follower's yaw becomes known through mutual bearings alone.

The covariance is P = L L', and the filter keeps the lower triangular L. With the whitened measurement matrix
W = R^(-1/2) H L, the covariance after a measurement is L (I + W' W)^(-1) L'. It is symmetric and positive
definite by construction. With I + W' W = U U' and U upper triangular, its factor L U'^(-1) is lower
triangular.

This module says what the filter computes. ``team_kernel`` does the same in C, for flights.
"""

from typing import Protocol

import numpy as np
from scipy.linalg import solve_triangular

from relform_controller.compiled import Kernel
from relform_controller.estimation import team_geometry, team_model
from relform_controller.estimation.estimator import TeamCovariances
from relform_controller.estimation.team_belief import Belief, Innovation, Observation, cholesky
from relform_controller.estimation.team_model import N_FILTER_STATE
from relform_controller.ocp import layout
from relform_controller.ocp.frames import wrap_angles
from relform_controller.ocp.model import RigidBody
from relform_controller.ocp.problem import TeamGeometry
from relform_core.arrays import Array

_POSE = [*range(N_FILTER_STATE)[layout.POSITION], *range(N_FILTER_STATE)[layout.RPY]]
_TORQUE_ROWS = slice(team_model.TILT_ROWS.start, team_model.RATE_ROWS.stop)
_PLACE_ROWS = [*range(team_model.N_OWN_ROWS)[team_model.POSITION_ROWS], team_model.YAW_ROW]


class TeamFilter(Protocol):
    """Prediction and correction of a team's belief."""

    def predict(self, belief: Belief, thrusts: Array, duration: float, noise: Array) -> Belief:
        """The belief some time later.

        Args:
            thrusts: mean thrust of each rotor in the interval [N], shape (vehicle, 4).
            duration: length of the interval [s].
            noise: variances that the interval adds, shape (vehicle, 19).
        """

    def innovation(self, belief: Belief, thrusts: Array, observation: Observation) -> Innovation:
        """What an observation says beyond the belief.

        Args:
            thrusts: of each rotor at the instant of the observation [N], shape (vehicle, 4).
        """

    def correct(self, belief: Belief, innovation: Innovation) -> Belief:
        """The belief after an observation."""

    def geometry(self, belief: Belief) -> tuple[Array, TeamGeometry, TeamCovariances]:
        """The start of the horizon in the {mi} frames of the vehicles, see ``team_geometry``."""


class ReferenceTeamFilter:
    """The filter in NumPy: slower than its kernel, and needs no compiler.

    Args:
        body: the nominal body of every vehicle.
        n_vehicles: number of vehicles.
    """

    def __init__(self, body: RigidBody, n_vehicles: int) -> None:
        self._n = n_vehicles
        pairs = layout.ordered_pairs(n_vehicles)
        self._observers = np.array([i for i, _ in pairs], dtype=np.intp)
        self._targets = np.array([j for _, j in pairs], dtype=np.intp)
        self._transition = Kernel.interpreted(team_model.transition(body), n_vehicles)
        self._own_measurement = Kernel.interpreted(team_model.own_measurement(body), n_vehicles)
        self._sighting = Kernel.interpreted(team_model.sighting(), len(pairs))

    def predict(self, belief: Belief, thrusts: Array, duration: float, noise: Array) -> Belief:
        """See ``TeamFilter``: P = F L L' F' + diag(noise)."""
        durations = np.full((self._n, 1), duration)
        states, F = self._transition(belief.states, thrusts, durations)
        blocks = belief.factor.reshape(self._n, N_FILTER_STATE, -1)
        moved = (F @ blocks).reshape(belief.factor.shape)  # F L, block by block
        covariance = moved @ moved.T
        covariance[np.diag_indices_from(covariance)] += noise.reshape(-1)
        return Belief(states.copy(), cholesky(covariance))

    def innovation(self, belief: Belief, thrusts: Array, observation: Observation) -> Innovation:
        """See ``TeamFilter``."""
        expected, H = self._own_measurement(belief.states, thrusts)
        own = observation.own - expected
        own[:, team_model.ANGULAR_ROWS] = wrap_angles(own[:, team_model.ANGULAR_ROWS])
        own *= observation.own_weights
        own_by_state = observation.own_weights[:, :, None] * H
        expected, H_observer, H_target = self._sighting(
            belief.states[self._observers], belief.states[self._targets]
        )
        sightings = observation.sightings - expected
        sightings[:, 1:] = wrap_angles(sightings[:, 1:])
        weights = observation.sighting_weights
        sightings = (weights @ sightings[:, :, None])[:, :, 0]
        by_observer = weights @ H_observer[:, :, _POSE]
        by_target = weights @ H_target[:, :, layout.POSITION]
        own_rows = self._own_rows(belief, own_by_state)
        sighting_rows = self._sighting_rows(belief, by_observer, by_target)
        return Innovation(
            own,
            own_by_state,
            sightings,
            by_observer,
            by_target,
            forces=_normalised(
                own[:, team_model.SPECIFIC_FORCE_ROWS], own_rows[:, team_model.SPECIFIC_FORCE_ROWS]
            ),
            torque_distances=squared_distances(own[:, _TORQUE_ROWS], own_rows[:, _TORQUE_ROWS]),
            sighting_distances=squared_distances(sightings, sighting_rows),
            leader_distance=squared_distances(own[:1, _PLACE_ROWS], own_rows[:1, _PLACE_ROWS]),
        )

    def correct(self, belief: Belief, innovation: Innovation) -> Belief:
        """See ``TeamFilter``."""
        size = belief.factor.shape[0]
        W, r = self.rows(belief, innovation), residuals(innovation)
        M = np.eye(size) + W.T @ W
        U = cholesky(M[::-1, ::-1])[::-1, ::-1]
        factor = solve_triangular(U, belief.factor.T).T
        change = factor @ solve_triangular(U, W.T @ r)
        states = belief.states + change.reshape(belief.states.shape)
        states[:, layout.YAW] = wrap_angles(states[:, layout.YAW])
        return Belief(states, np.ascontiguousarray(factor))

    def geometry(self, belief: Belief) -> tuple[Array, TeamGeometry, TeamCovariances]:
        """See ``TeamFilter``."""
        states, geometry = team_geometry.states_and_geometry(belief)
        return states, geometry, team_geometry.covariances(belief, geometry)

    def rows(self, belief: Belief, innovation: Innovation) -> Array:
        """W: derivative of all ``residuals`` by the coordinates of the factor, shape (m, 19 n)."""
        own = self._own_rows(belief, innovation.own_by_state)
        sightings = self._sighting_rows(
            belief, innovation.sightings_by_observer, innovation.sightings_by_target
        )
        return np.concatenate([each.reshape(-1, each.shape[-1]) for each in (own, sightings)])

    def _own_rows(self, belief: Belief, own_by_state: Array) -> Array:
        rows: Array = own_by_state @ belief.factor.reshape(self._n, N_FILTER_STATE, -1)
        return rows

    def _sighting_rows(self, belief: Belief, by_observer: Array, by_target: Array) -> Array:
        blocks = belief.factor.reshape(self._n, N_FILTER_STATE, -1)
        rows: Array = by_observer @ blocks[:, _POSE][self._observers]
        rows += by_target @ blocks[:, layout.POSITION][self._targets]
        return rows


def residuals(innovation: Innovation) -> Array:
    """All whitened differences as one vector, shape (m,)."""
    return np.concatenate([innovation.own.reshape(-1), innovation.sightings.reshape(-1)])


def squared_distances(innovations: Array, rows: Array) -> Array:
    """Squared Mahalanobis distances of groups of whitened innovations, chi-square distributed.

    Args:
        innovations: shape (group, m).
        rows: rows of W, shape (group, m, size).
    Returns:
        r' (I + W W')^(-1) r, shape (group,).
    """
    distances: Array = (_normalised(innovations, rows) ** 2).sum(axis=1)
    return distances


def _normalised(innovations: Array, rows: Array) -> Array:
    """Groups of innovations, of unit covariance if the belief is right; arguments as above."""
    roots = np.linalg.cholesky(np.eye(innovations.shape[1]) + rows @ rows.swapaxes(1, 2))
    normalised: Array = np.linalg.solve(roots, innovations[:, :, None])[:, :, 0]
    return normalised
