"""Errors of the controller's estimates at each control step, and whether they are as large as it thinks.

An estimate is a position and a yaw [m, rad], in this order.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.tracking_errors import relative_positions, scored_pairs, yaw_of
from relform_controller.ocp.frames import wrap_angles
from relform_core.arrays import Array, Mask

CONFIDENCE = 0.95


@dataclass(frozen=True, eq=False)
class EstimationErrors:
    """Estimates minus truth, and what the estimator thinks of them."""

    errors: Array
    """x, y, z [m] and yaw in (-pi, pi] [rad], shape (K, ..., 4); NaN: not recorded."""
    covariances: Array
    """Shape (K, ..., 4, 4); NaN: unknown."""

    @property
    def deviations(self) -> Array:
        """Standard deviations, shape (K, ..., 4)."""
        return np.asarray(np.sqrt(np.diagonal(self.covariances, axis1=-2, axis2=-1)))

    def position_nees(self) -> Array:
        """Normalised estimation error squared of the position, shape (K, ...); three degrees of freedom."""
        errors, covariances = self.errors[..., :3], self.covariances[..., :3, :3]
        known = np.isfinite(errors).all(axis=-1) & np.isfinite(covariances).all(axis=(-2, -1))
        nees = np.full(known.shape, np.nan)
        solved = np.linalg.solve(covariances[known], errors[known][..., None])[..., 0]
        nees[known] = (errors[known] * solved).sum(axis=-1)
        return nees

    def yaw_nees(self) -> Array:
        """The same of the yaw, shape (K, ...); one degree of freedom."""
        return np.asarray(self.errors[..., 3] ** 2 / self.covariances[..., 3, 3])


def pair_estimation_errors(log: FlightLog) -> EstimationErrors:
    """Of the relative poses of the scored pairs, shape (K, pairs, ...)."""
    index = {name: position for position, name in enumerate(log.vehicles)}
    pairs = scored_pairs(log.scenario.config.team)
    observers = [index[observer] for observer, _ in pairs]
    targets = [index[target] for _, target in pairs]
    yaw = yaw_of(log.q_NB)[log.tick_of_step]
    p_BB_C = relative_positions(log.p_NB_N[log.tick_of_step], yaw)
    position = (log.p_BB_C__est - p_BB_C)[:, observers, targets]
    turned = log.yaw_BB__est[:, observers, targets] - (yaw[:, targets] - yaw[:, observers])
    return EstimationErrors(
        np.concatenate([position, wrap_angles(turned)[..., None]], axis=-1),
        log.pair_covariance,
    )


def leader_estimation_errors(log: FlightLog) -> EstimationErrors:
    """Of the leader's pose in {n}, shape (K, ...)."""
    position = log.leader_p_NB_N__est - log.p_NB_N[log.tick_of_step, log.leader]
    turned = log.leader_yaw__est - yaw_of(log.q_NB[log.tick_of_step, log.leader])
    return EstimationErrors(
        np.concatenate([position, wrap_angles(turned)[:, None]], axis=-1), log.leader_covariance
    )


def nis_bounds(nis_dof: Array) -> tuple[Array, Array]:
    """The 95 % interval of the normalised innovation squared; NaN without degrees of freedom."""
    from scipy.special import chdtri  # imported here, because SciPy is slow to import

    tail = (1.0 - CONFIDENCE) / 2.0
    dof = np.where(nis_dof > 0.0, nis_dof, np.nan)
    return chdtri(dof, 1.0 - tail), chdtri(dof, tail)


@dataclass(frozen=True)
class Consistency:
    """Whether the estimator knows its errors, in the steady windows; NaN: it gave no covariances."""

    position_nees: float
    """Of the relative positions of the scored pairs: mean NEES per degree of freedom; 1: the covariances are
    right, above 1: they are too small."""
    yaw_nees: float
    """Of their relative yaws."""
    leader_nees: float
    """Of the leader's position."""
    nis_inside: float
    """Share of the steps whose NIS of range and bearing is in its 95 % interval."""

    @classmethod
    def of(cls, log: FlightLog, steps: Mask) -> Self:
        """Over some control steps, shape (K,)."""
        between, leader = pair_estimation_errors(log), leader_estimation_errors(log)
        nis = log.estimator["nis"]
        low, high = nis_bounds(log.estimator["nis_dof"])
        is_known = np.isfinite(nis) & np.isfinite(low) & steps
        inside = (low <= nis) & (nis <= high)
        return cls(
            position_nees=_mean(between.position_nees()[steps] / 3.0),
            yaw_nees=_mean(between.yaw_nees()[steps]),
            leader_nees=_mean(leader.position_nees()[steps] / 3.0),
            nis_inside=_mean(inside[is_known].astype(np.float64)),
        )


def _mean(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else np.nan
