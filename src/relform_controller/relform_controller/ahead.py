"""Prediction of the team over the time that commands need to reach it."""

from collections.abc import Iterable

import numpy as np

from relform_controller.compiled import CompiledFunction
from relform_controller.ocp.problem import Plan, Prediction, TeamGeometry
from relform_controller.ocp.rotor_lag import RotorLag, Rotors
from relform_controller.solver.warm_start import transform
from relform_core.arrays import Array


def predict_ahead(
    states: Array,
    geometry: TeamGeometry,
    mean_thrusts: Iterable[Array],
    predict: CompiledFunction,
    pairs: tuple[tuple[int, int], ...],
) -> Prediction:
    """States and {mi} frames of the team after intervals with known mean thrusts.

    Args:
        states: in the {mi} of each vehicle at the start, shape (vehicle, N_STATE).
        geometry: where these frames lie, and what disturbs the vehicles.
        mean_thrusts: of each interval [N], shape (vehicle, N_INPUT).
        predict: (state, mean thrusts, disturbance if there is one) -> (state one control period later,), of
            all vehicles.
        pairs: (observer, target) of the geometry.
    """
    disturbances = () if geometry.disturbances is None else (geometry.disturbances.inputs,)
    for each in mean_thrusts:
        (states,) = predict(states, each, *disturbances)
    none = np.empty((len(states), 0))
    rotors = Rotors(RotorLag(0.0), none)
    moved, geometry_ahead = transform(Plan(states[:, None], none, rotors), geometry, pairs)
    return Prediction(moved.states[:, 0], geometry_ahead)
