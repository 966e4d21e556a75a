"""What the team filter believes, what it is told, and what it concludes from the two."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import lapack

from relform_core.arrays import Array, Mask


@dataclass(frozen=True, eq=False)
class Belief:
    """Mean and covariance of the team's state at one instant; vehicles in team order."""

    states: Array
    """Mean, see ``team_model``; shape (vehicle, 19)."""
    factor: Array
    """L of the covariance P = L L', lower triangular with a positive diagonal; the state's vehicles one after
    the other, shape (19 n, 19 n)."""

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
        return replace(self, factor=cholesky(self.covariance + deviations @ deviations.T))


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
    """Measured minus expected, whitened, its derivatives H, and how likely the belief finds it."""

    own: Array
    """Shape (vehicle, 23)."""
    own_by_state: Array
    """By the vehicle's state, shape (vehicle, 23, 19)."""
    sightings: Array
    """Shape (pair, 3)."""
    sightings_by_observer: Array
    """By position, roll, pitch and yaw of the observer, shape (pair, 3, 6)."""
    sightings_by_target: Array
    """By the target's position in {n} [1/m], shape (pair, 3, 3)."""
    forces: Array
    """Innovation of each accelerometer, of unit covariance if the belief is right; shape (vehicle, 3)."""
    torque_distances: Array
    """Squared Mahalanobis distances of the tilt and the rates, shape (vehicle,)."""
    sighting_distances: Array
    """Squared Mahalanobis distances, chi-square distributed with three degrees; shape (pair,)."""
    leader_distance: Array
    """Squared Mahalanobis distance of the leader's measured position and yaw, shape (1,)."""

    def without(self, sightings: Mask) -> "Innovation":
        """The same without some sightings, shape (pair,)."""
        keep = ~sightings
        return replace(
            self,
            sightings=self.sightings * keep[:, None],
            sightings_by_observer=self.sightings_by_observer * keep[:, None, None],
            sightings_by_target=self.sightings_by_target * keep[:, None, None],
        )


def cholesky(matrix: Array) -> Array:
    """Lower factor of a symmetric positive definite matrix.

    Raises:
        numpy.linalg.LinAlgError: it is not positive definite.
    """
    factor, failed = lapack.dpotrf(matrix, lower=1, clean=1)
    check_definite(failed)
    return np.ascontiguousarray(factor)


def check_definite(failed: int) -> None:
    """Raise LinAlgError if the factorisation of a covariance has failed."""
    if failed:
        raise np.linalg.LinAlgError("the covariance of the team is not positive definite")
