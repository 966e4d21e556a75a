"""Finds the lag of the rotors in flight, from how the vehicles turn after each command.

Attitudes at three instants give the change of a vehicle's mean rates from one interval to the next. Each
candidate for the time constant predicts it from the commands, and what is measured tells them apart within
half a second. The evidence of all vehicles and intervals adds up until one candidate remains.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from relform_controller.ocp.model import RigidBody, torque_by_thrusts
from relform_controller.ocp.rotor_lag import RotorLag
from relform_core.arrays import Array

CANDIDATES = (0.0, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.08)
"""Time constants [s], beside the configured one."""
MODEL_ERROR = 0.1
"""Relative standard deviation of a predicted change of the rates: twice that of the moments of inertia."""
TERM_MAX = 4.5
"""Most that one component of one measurement may say against a candidate, so that no outlier decides."""
LIKELIER = 12.0
"""By how much the logarithm of the likelihood must exceed that of the configured time constant."""
DECIDED = 50.0
"""By how much a candidate must exceed all others to remain alone."""


@dataclass(frozen=True, eq=False)
class LagEvidence:
    """What is known at an instant. Arrays by candidate have it in the first axis."""

    time_constants: Array
    """Of the candidates [s]."""
    configured: int
    """Index of the configured time constant, as long as there are others."""
    log_likelihoods: Array
    thrusts: Array
    """Of the rotors [N], shape (candidate, vehicle, 4)."""
    q_NB: Array
    """Last attitude measured, shape (vehicle, 4); NaN: none yet."""
    rate: Array
    """Mean angular velocity over the interval that ended then [rad/s], shape (vehicle, 3); NaN: unknown."""
    rate_gain: Array
    """Angular velocity then minus that mean [rad/s], shape (candidate, vehicle, 3)."""
    time: Array
    """Since then [s], shape (vehicle, 1)."""
    turn: Array
    """Since then, beyond that at a constant rate [rad], shape (candidate, vehicle, 3)."""
    change: Array
    """Of the angular velocity since then [rad/s], shape (candidate, vehicle, 3)."""

    @property
    def is_decided(self) -> bool:
        """Whether one candidate remains."""
        return len(self.time_constants) == 1

    @property
    def best(self) -> int:
        """Index of the candidate to believe: the configured one unless another is far likelier."""
        likeliest = int(np.argmax(self.log_likelihoods))
        lead = self.log_likelihoods[likeliest] - self.log_likelihoods[self.configured]
        return likeliest if lead > LIKELIER else self.configured

    @property
    def lag(self) -> RotorLag:
        """The lag to believe."""
        return RotorLag(float(self.time_constants[self.best]))


class LagFinder:
    """Gathers evidence for the time constant of all rotors of a team.

    Args:
        body: the nominal body of every vehicle.
        configured: nominal time constant [s].
        others: the candidates beside it [s].
    """

    def __init__(self, body: RigidBody, configured: float, others: Sequence[float] = CANDIDATES) -> None:
        self._inertia = np.array(body.inertia)
        self._acceleration_by_thrusts = (torque_by_thrusts(body) / self._inertia[:, None]).T
        self._configured = configured
        self._time_constants = sorted({configured, *others})

    def start(self, thrusts: Array) -> LagEvidence:
        """Nothing is known but the thrusts of the rotors [N], shape (vehicle, 4)."""
        time_constants = np.array(self._time_constants)
        n_vehicles, by_candidate = len(thrusts), (len(time_constants), len(thrusts), 3)
        return LagEvidence(
            time_constants,
            configured=int(np.searchsorted(time_constants, self._configured)),
            log_likelihoods=np.zeros(len(time_constants)),
            thrusts=np.repeat(thrusts[None], len(time_constants), axis=0),
            q_NB=np.full((n_vehicles, 4), np.nan),
            rate=np.full((n_vehicles, 3), np.nan),
            rate_gain=np.zeros(by_candidate),
            time=np.zeros((n_vehicles, 1)),
            turn=np.zeros(by_candidate),
            change=np.zeros(by_candidate),
        )

    def commanded(self, evidence: LagEvidence, commands: Array, duration: float) -> LagEvidence:
        """What is known after an interval of constant commands [N], shape (vehicle, 4)."""
        lags = [RotorLag(float(each)) for each in evidence.time_constants]
        thrusts = np.array(
            [
                lag.after(before, commands, duration)
                for lag, before in zip(lags, evidence.thrusts, strict=True)
            ]
        )
        if evidence.is_decided:
            return replace(evidence, thrusts=thrusts)
        end = commands @ self._acceleration_by_thrusts
        beyond = (evidence.thrusts - commands) @ self._acceleration_by_thrusts
        # The integral of exp(-t / time constant) over the interval, and the integral of that.
        tau = evidence.time_constants[:, None, None]
        once = -tau * np.expm1(-duration / np.maximum(tau, 1e-9))
        twice = tau * (duration - once)
        return replace(
            evidence,
            thrusts=thrusts,
            time=evidence.time + duration,
            turn=evidence.turn + evidence.change * duration + 0.5 * duration**2 * end + twice * beyond,
            change=evidence.change + duration * end + once * beyond,
        )

    def measured(
        self, evidence: LagEvidence, vehicles: Sequence[int], q_NB: Array, variances: Array
    ) -> LagEvidence:
        """What is known after attitudes of some vehicles were measured.

        Args:
            vehicles: their indices.
            q_NB: their attitudes; the yaw is not used. Shape (measured, 4).
            variances: of each of their tilt angles [rad^2], shape (measured,).
        """
        v = np.asarray(vehicles, dtype=np.intp)
        if evidence.is_decided:
            return evidence
        time = np.maximum(evidence.time[v], 1e-9)
        rate = _turn(evidence.q_NB[v], q_NB) / time
        gyroscopic = time * np.cross(rate, self._inertia * rate) / self._inertia
        found = rate - evidence.rate[v] + gyroscopic
        expected = evidence.rate_gain[:, v] + evidence.turn[:, v] / time
        variance = 6.0 * variances[:, None] / time**2 + (MODEL_ERROR * expected) ** 2
        against = 0.5 * ((found - expected) ** 2 / variance + np.log(variance))[:, :, :2]
        against = np.minimum(np.nan_to_num(against - against.min(axis=0)), TERM_MAX)
        return _alone(
            replace(
                evidence,
                log_likelihoods=evidence.log_likelihoods - against.sum(axis=(1, 2)),
                q_NB=_with(evidence.q_NB, v, q_NB),
                rate=_with(evidence.rate, v, rate),
                rate_gain=_with(evidence.rate_gain, v, evidence.change[:, v] - evidence.turn[:, v] / time),
                time=_with(evidence.time, v, 0.0),
                turn=_with(evidence.turn, v, 0.0),
                change=_with(evidence.change, v, 0.0),
            )
        )


def _with(array: Array, vehicles: npt.NDArray[np.intp], values: Array | float) -> Array:
    """The same with other values for some vehicles, whose axis is the last but one."""
    changed = array.copy()
    changed[..., vehicles, :] = values
    return changed


def _turn(before: Array, after: Array) -> Array:
    """Rotation vectors in the body frame from attitudes to others [rad], shape (vehicle, 3)."""
    x0, y0, z0, w0 = before.T
    x, y, z, w = after.T
    vector = np.array(
        [
            w0 * x - x0 * w - y0 * z + z0 * y,
            w0 * y + x0 * z - y0 * w - z0 * x,
            w0 * z - x0 * y + y0 * x - z0 * w,
        ]
    )
    scalar = w0 * w + x0 * x + y0 * y + z0 * z
    sine = np.linalg.norm(vector, axis=0)
    angle = 2.0 * np.arctan2(sine, np.abs(scalar))
    turn: Array = (vector * np.sign(scalar) * np.where(sine > 0.0, angle / np.maximum(sine, 1e-300), 2.0)).T
    return turn


def _alone(evidence: LagEvidence) -> LagEvidence:
    """The same with one candidate, if it is far likelier than all others."""
    order = np.argsort(evidence.log_likelihoods)
    if evidence.log_likelihoods[order[-1]] - evidence.log_likelihoods[order[-2]] < DECIDED:
        return evidence
    only = slice(int(order[-1]), int(order[-1]) + 1)
    return replace(
        evidence,
        time_constants=evidence.time_constants[only],
        configured=0,
        log_likelihoods=np.zeros(1),
        thrusts=evidence.thrusts[only],
    )
