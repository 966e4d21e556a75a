"""The posterior Cramer-Rao bound: how well any estimator can know the team, with its sensors on a flight.

The recursion is that of Tichavsky, Muravchik and Nehorai (Posterior Cramer-Rao bounds for discrete-time
nonlinear filtering, IEEE Transactions on Signal Processing, 1998), for additive Gaussian noise and along one
true trajectory, which stands for their expectation over trajectories.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from relform_analysis.judges.flown import FlownStep
from relform_analysis.judges.linearised import LinearisedTeam, pair_position_jacobian
from relform_controller.estimation import team_noise
from relform_controller.ocp import layout
from relform_controller.ocp.model import RigidBody
from relform_core.arrays import Array

NEARLY_NOTHING = 1e-7
"""Standard deviation of what a model takes for known, in SI units; keeps matrices regular."""


@dataclass(frozen=True)
class Assumption:
    """What an estimator knows of the motion, besides the thrusts."""

    name: str
    noise: team_noise.ProcessNoise
    prior: Array
    """Standard deviations of the first state of a vehicle, shape (19,)."""


def _first(disturbance: float, thrust_scale: float) -> Array:
    """Nothing is known of the pose; the vehicles are nearly at rest."""
    return team_noise.per_state(
        position=10.0,
        velocity=0.1,
        tilt=0.1,
        yaw=3.0,
        rate=0.1,
        disturbance=disturbance,
        thrust_scale=thrust_scale,
        inertia_scale=NEARLY_NOTHING,
    )


_EXACT = team_noise.ProcessNoise(
    velocity=NEARLY_NOTHING,
    angle=NEARLY_NOTHING,
    rate=NEARLY_NOTHING,
    inertia=0.0,
    disturbance=NEARLY_NOTHING,
    thrust_scale=NEARLY_NOTHING,
    inertia_scale=NEARLY_NOTHING,
)
ASSUMPTIONS = (
    Assumption("motion and forces known exactly", _EXACT, _first(NEARLY_NOTHING, NEARLY_NOTHING)),
    Assumption("the same, with an unknown constant force and thrust", _EXACT, _first(1.0, 0.1)),
    Assumption("motion as uncertain as the filter assumes", team_noise.ProcessNoise(), team_noise.START),
)


def next_information(information: Array, F: Array, Q: Array, measured: Array) -> Array:
    """One step of the recursion, eq. (21) for additive Gaussian noise.

    J' = D22 - D21 (J + D11)^-1 D12 with D11 = F' Q^-1 F, D12 = D21' = -F' Q^-1, D22 = Q^-1 + H' R^-1 H is, by
    the matrix inversion lemma, (Q + F J^-1 F')^-1 + H' R^-1 H, which also holds for a singular Q.

    Args:
        information: J, of the state before, shape (n, n).
        F: Jacobian of the motion at the true state before, shape (n, n).
        Q: covariance of the process noise, shape (n, n).
        measured: H' R^-1 H at the true state after, shape (n, n).
    """
    covariance = Q + F @ np.linalg.solve(information, F.T)
    following: Array = np.linalg.inv((covariance + covariance.T) / 2.0) + measured
    return (following + following.T) / 2.0


def pair_bounds(steps: Sequence[FlownStep], body: RigidBody, period: float, assumption: Assumption) -> Array:
    """Bound on the root mean square error of the position of each ordered pair in {mc_i} at each step [m].

    Args:
        steps: of a flight, from its start.
        body: the nominal body of every vehicle.
        period: control period [s].
    Returns:
        Shape (steps, pairs).
    """
    n = len(steps[0].states)
    bounds = np.zeros((len(steps), n * (n - 1)))
    for step, information in enumerate(_informations(steps, body, period, assumption)):
        covariance = np.linalg.inv(information)
        for pair, (i, j) in enumerate(layout.ordered_pairs(n)):
            jacobian = pair_position_jacobian(steps[step].states, i, j)
            bounds[step, pair] = np.sqrt(np.trace(jacobian @ covariance @ jacobian.T))
    return bounds


def _informations(
    steps: Sequence[FlownStep], body: RigidBody, period: float, assumption: Assumption
) -> Iterator[Array]:
    n = len(steps[0].states)
    team = LinearisedTeam(body, n, period)
    _, W = team.measurement(steps[0].states, steps[0].thrusts, steps[0].observation)
    information = np.diag(np.tile(assumption.prior, n) ** -2.0) + W.T @ W
    yield information
    for before, after in pairwise(steps):
        _, F = team.motion(before.states, before.thrusts)
        Q = np.diag(assumption.noise.variances(before.thrusts, period, body).reshape(-1))
        _, W = team.measurement(after.states, before.thrusts, after.observation)
        information = next_information(information, F, Q, W.T @ W)
        yield information
