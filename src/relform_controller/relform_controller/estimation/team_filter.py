"""Square-root Kalman filter of the whole team, free of sensors and time stamps.

All vehicles share one state in the world frame {n} and one covariance with all cross terms. Relative
quantities stay accurate while the absolute ones drift together, so the formation does not depend on the
leader's localization. A follower's yaw becomes known through mutual bearings alone.

The covariance is P = L L', and the filter keeps a factor L. With the whitened measurement matrix
W = R^(-1/2) H L, the covariance after a measurement is L (I + W' W)^(-1) L'. It is symmetric and positive
definite by construction.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import lapack

from relform_controller.compiled import compiled
from relform_controller.estimation import team_model
from relform_controller.estimation.team_model import N_FILTER_STATE
from relform_controller.ocp import layout
from relform_controller.ocp.frames import wrap_angles
from relform_controller.ocp.model import RigidBody
from relform_core.arrays import Array

_POSE = [*range(N_FILTER_STATE)[layout.POSITION], *range(N_FILTER_STATE)[layout.RPY]]


@dataclass(frozen=True, eq=False)
class Belief:
    """Mean and covariance of the team's state at one instant; vehicles in team order."""

    states: Array
    """Mean, see ``team_model``; shape (vehicle, 19)."""
    factor: Array
    """L of the covariance P = L L'; the state's vehicles one after the other, shape (19 n, 19 n)."""

    @property
    def covariance(self) -> Array:
        """P, shape (19 n, 19 n)."""
        return self.factor @ self.factor.T

    def widened(self, deviations: Array) -> "Belief":
        """The same mean, less certain.

        Args:
            deviations: independent random deviations of one standard deviation each, as columns; shape
                (19 n, m).
        """
        return replace(self, factor=_cholesky(self.covariance + deviations @ deviations.T))


@dataclass(frozen=True, eq=False)
class Observation:
    """What was measured at one instant, whitened: a square root of the information, zero where nothing was.

    A measurement z with covariance R has the weight R^(-1/2), for which any square root may serve.
    """

    own: Array
    """What each vehicle measured of itself, rows of ``team_model``; shape (vehicle, 23)."""
    own_weights: Array
    """Reciprocal standard deviations, 0: not measured; shape (vehicle, 23)."""
    sightings: Array
    """Range, azimuth, elevation; shape (pair, 3), pairs as ``layout.ordered_pairs``."""
    sighting_weights: Array
    """Square roots of the information matrices, all zero: not seen; shape (pair, 3, 3)."""


@dataclass(frozen=True, eq=False)
class Innovation:
    """Measured minus expected, whitened, with its derivative by the factor's coordinates."""

    own: Array
    """Shape (vehicle, 23)."""
    own_rows: Array
    """Rows of W, shape (vehicle, 23, 19 n)."""
    sightings: Array
    """Shape (pair, 3)."""
    sighting_rows: Array
    """Rows of W, shape (pair, 3, 19 n)."""
    sightings_by_position: Array
    """Derivative of the whitened sightings by the target's position in {n} [1/m], shape (pair, 3, 3)."""


class TeamFilter:
    """Prediction and correction of a team's belief.

    Args:
        body: the nominal body of every vehicle.
        n_vehicles: number of vehicles.
    Raises:
        RelformError: there is no C compiler, or it fails.
    """

    def __init__(self, body: RigidBody, n_vehicles: int) -> None:
        self._n = n_vehicles
        pairs = layout.ordered_pairs(n_vehicles)
        self._observers = np.array([i for i, _ in pairs], dtype=np.intp)
        self._targets = np.array([j for _, j in pairs], dtype=np.intp)
        kernels = compiled(
            [
                (team_model.transition(body), n_vehicles),
                (team_model.own_measurement(body), n_vehicles),
                (team_model.sighting(), len(pairs)),
            ]
        )
        self._transition = kernels["transition"]
        self._own_measurement = kernels["own_measurement"]
        self._sighting = kernels["sighting"]

    def predict(self, belief: Belief, thrusts: Array, duration: float, noise: Array) -> Belief:
        """The belief some time later.

        Args:
            thrusts: mean thrust of each rotor in the interval [N], shape (vehicle, 4).
            duration: length of the interval [s].
            noise: variances that the interval adds, shape (vehicle, 19).
        """
        durations = np.full((self._n, 1), duration)
        states, F = self._transition(belief.states, thrusts, durations)
        blocks = belief.factor.reshape(self._n, N_FILTER_STATE, -1)
        moved = (F @ blocks).reshape(belief.factor.shape)  # F L, block by block
        covariance = moved @ moved.T
        covariance[np.diag_indices_from(covariance)] += noise.reshape(-1)
        return Belief(states.copy(), _cholesky(covariance))

    def innovation(self, belief: Belief, thrusts: Array, observation: Observation) -> Innovation:
        """What an observation says beyond the belief.

        Args:
            thrusts: of each rotor at the instant of the observation [N], shape (vehicle, 4).
        """
        blocks = belief.factor.reshape(self._n, N_FILTER_STATE, -1)
        expected, H = self._own_measurement(belief.states, thrusts)
        own = observation.own - expected
        own[:, team_model.ANGULAR_ROWS] = wrap_angles(own[:, team_model.ANGULAR_ROWS])
        own *= observation.own_weights
        own_rows = (observation.own_weights[:, :, None] * H) @ blocks
        expected, H_observer, H_target = self._sighting(
            belief.states[self._observers], belief.states[self._targets]
        )
        sightings = observation.sightings - expected
        sightings[:, 1:] = wrap_angles(sightings[:, 1:])
        weights = observation.sighting_weights
        by_position = weights @ H_target[:, :, layout.POSITION]
        # A sighting depends on the pose of the observer and on the position of the target alone.
        sighting_rows = (weights @ H_observer[:, :, _POSE]) @ blocks[:, _POSE][self._observers]
        sighting_rows += by_position @ blocks[:, layout.POSITION][self._targets]
        return Innovation(
            own,
            own_rows,
            (weights @ sightings[:, :, None])[:, :, 0],
            sighting_rows,
            by_position,
        )

    def correct(self, belief: Belief, innovation: Innovation) -> Belief:
        """The belief after an observation."""
        size = belief.factor.shape[0]
        measured = innovation.own_rows.any(axis=2)
        W = np.concatenate([innovation.own_rows[measured], innovation.sighting_rows.reshape(-1, size)])
        r = np.concatenate([innovation.own[measured], innovation.sightings.reshape(-1)])
        C = _cholesky(np.eye(size) + W.T @ W)
        # L (C')^(-1), the transpose of which solves C X = L'
        factor = lapack.dtrtrs(C, belief.factor.T, lower=1)[0].T
        change = factor @ lapack.dtrtrs(C, W.T @ r, lower=1)[0]
        states = belief.states + change.reshape(belief.states.shape)
        states[:, layout.YAW] = wrap_angles(states[:, layout.YAW])
        return Belief(states, np.ascontiguousarray(factor))


def squared_distances(innovations: Array, rows: Array) -> Array:
    """Squared Mahalanobis distances of groups of whitened innovations, chi-square distributed.

    Args:
        innovations: shape (group, m).
        rows: rows of W, shape (group, m, size).
    Returns:
        r' (I + W W')^(-1) r, shape (group,).
    """
    covariances = np.eye(innovations.shape[1]) + rows @ rows.swapaxes(1, 2)
    solved = np.linalg.solve(covariances, innovations[:, :, None])
    distances: Array = (innovations[:, None, :] @ solved)[:, 0, 0]
    return distances


def _cholesky(matrix: Array) -> Array:
    """Lower factor of a symmetric positive definite matrix."""
    factor, failed = lapack.dpotrf(matrix, lower=1, clean=1)
    if failed:
        raise np.linalg.LinAlgError("the covariance of the team is not positive definite")
    return np.asarray(factor)
