"""The quadratic program of one SQP step of the team, stage by stage.

The unknowns are the deviations dz_k and du_k from a guess:

    dz_{k+1} = A_k dz_k + B_k du_k + gap_k,   lower_k <= du_k <= upper_k,

with the cost

    sum_k  1/2 dz_k' Q_k dz_k + du_k' S_k dz_k + 1/2 du_k' R_k du_k + q_k' dz_k + r_k' du_k  +  constant.

Soft constraints C_k dz_k + c_k <= sigma_k at stages 1..N add their violation sigma_k >= 0 to the cost,
linear_price' sigma_k + 1/2 sigma_k' diag(square_price) sigma_k.

`z` holds the stage states of all vehicles (``stages``), `u` all commands. The dynamics couple no vehicles, so
A and B are block diagonal; Q couples pairs.

To minimise it, dz is split into the free response, which follows the dynamics from the measured start with
du = 0, and the rest, which starts at zero and has no gaps (`about`).
"""

import dataclasses
from dataclasses import dataclass

import numpy as np

from relform_core.arrays import Array


@dataclass(frozen=True, eq=False)
class TeamQp:
    """The matrices and vectors of the quadratic program; nz and nu are the sizes of z and u."""

    A: Array
    """Shape (stage 0..N-1, nz, nz)."""
    B: Array
    """Shape (stage 0..N-1, nz, nu)."""
    gap: Array
    """Shape (stage 0..N-1, nz)."""
    Q: Array
    """Shape (stage 0..N, nz, nz)."""
    S: Array
    """Shape (stage 0..N-1, nu, nz)."""
    R: Array
    """Shape (stage 0..N-1, nu, nu)."""
    q: Array
    """Shape (stage 0..N, nz)."""
    r: Array
    """Shape (stage 0..N-1, nu)."""
    lower: Array
    """Shape (stage 0..N-1, nu)."""
    upper: Array
    """Shape (stage 0..N-1, nu)."""
    constant: float
    C: Array
    """Shape (stage 1..N, row, nz)."""
    c: Array
    """Shape (stage 1..N, row)."""
    linear_price: Array
    """Shape (row,)."""
    square_price: Array
    """Shape (row,)."""


def free_response(qp: TeamQp, dz0: Array) -> Array:
    """The deviations that follow from a start deviation dz0 with du = 0, shape (stage 0..N, nz)."""
    dz = [dz0]
    for A, gap in zip(qp.A, qp.gap, strict=True):
        dz.append(A @ dz[-1] + gap)
    return np.array(dz)


def about(qp: TeamQp, free: Array) -> TeamQp:
    """The same quadratic program for what is added to the free response: it starts at zero, without gaps."""
    no_command = np.zeros_like(qp.r)
    q, r = gradient(qp, free, no_command)
    constant = qp.constant + 0.5 * np.sum((qp.q + q) * free)
    return dataclasses.replace(
        qp, gap=np.zeros_like(qp.gap), q=q, r=r, constant=float(constant), c=soft_rows(qp, free)
    )


def soft_rows(qp: TeamQp, dz: Array) -> Array:
    """h = C dz + c, shape (stage 1..N, row)."""
    rows: Array = np.einsum("kmz,kz->km", qp.C, dz[1:]) + qp.c
    return rows


def gradient(qp: TeamQp, dz: Array, du: Array) -> tuple[Array, Array]:
    """Gradient of the cost of the stages by dz and du, without that of soft constraints."""
    q = qp.q + np.einsum("kij,kj->ki", qp.Q, dz)
    q[:-1] += np.einsum("kuz,ku->kz", qp.S, du)
    r = qp.r + np.einsum("kij,kj->ki", qp.R, du) + np.einsum("kuz,kz->ku", qp.S, dz[:-1])
    return q, r
