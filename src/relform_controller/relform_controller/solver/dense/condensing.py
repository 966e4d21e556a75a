"""Full condensing: the deviation of every state as an affine map of inputs and initial state."""

from dataclasses import dataclass

import numpy as np

from relform_controller.ocp import layout
from relform_controller.ocp.rotor_lag import HorizonLag
from relform_core.arrays import Array


@dataclass(frozen=True, eq=False)
class StateMaps:
    """dx_k = by_inputs_k du + by_initial_k dx_0 + by_rotors_k dT_0 + offset_k of each vehicle.

    The dynamics couple no vehicles.
    """

    by_inputs: Array
    """Shape (vehicle, stage 0..N, N_STATE, N * N_INPUT); du holds the own inputs, stage by stage."""
    by_initial: Array
    """Shape (vehicle, stage 0..N, N_STATE, N_STATE)."""
    offset: Array
    """Closes the gaps between the stages, shape (vehicle, stage 0..N, N_STATE)."""
    by_rotors: Array | None = None
    """By the thrusts of the rotors at the start, shape (vehicle, stage 0..N, N_STATE, N_INPUT); None: the
    rotors have no lag, so they do not matter."""

    def free_response(self, initial_deviation: Array, rotor_deviation: Array) -> Array:
        """Deviation of the states [vehicle, stage 0..N, N_STATE] with the inputs as they are."""
        response: Array = self.offset + np.einsum("vkij,vj->vki", self.by_initial, initial_deviation)
        if self.by_rotors is not None:
            response += np.einsum("vkij,vj->vki", self.by_rotors, rotor_deviation)
        return response

    def through(self, lag: HorizonLag) -> "StateMaps":
        """These maps by the commands, if they are now by the mean thrusts of each stage."""
        by_inputs, by_rotors = (self.by_inputs @ each for each in (lag.by_commands, lag.by_start))
        return StateMaps(by_inputs, self.by_initial, self.offset, by_rotors)


def condense(A: Array, B: Array, gaps: Array) -> StateMaps:
    """Eliminate the states from dx_{k+1} = A_k dx_k + B_k du_k + gap_k.

    Args:
        A: shape (vehicle, stage 0..N-1, N_STATE, N_STATE).
        B: shape (vehicle, stage 0..N-1, N_STATE, N_INPUT).
        gaps: shape (vehicle, stage 0..N-1, N_STATE).
    """
    n_vehicles, n_stages, _, n_input = B.shape
    n_own = n_stages * n_input
    # One matrix per stage holds all three maps side by side, so that one product advances all of them.
    maps = np.zeros((n_vehicles, n_stages + 1, layout.N_STATE, n_own + layout.N_STATE + 1))
    maps[:, 0, :, n_own:-1] = np.eye(layout.N_STATE)
    for k in range(n_stages):
        np.matmul(A[:, k], maps[:, k], out=maps[:, k + 1])
        maps[:, k + 1, :, k * n_input : (k + 1) * n_input] = B[:, k]
        maps[:, k + 1, :, -1] += gaps[:, k]
    return StateMaps(maps[..., :n_own], maps[..., n_own:-1], maps[..., -1])
