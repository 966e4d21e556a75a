"""Warm start of the next control step: shift the plan in time, and transform it into the next {mi} frames.

The {mi} of a vehicle moves to where its body is predicted to be one period later; position and yaw of the
shifted guess then start at zero, as those of the next measurement do (Algorithm MRTI).
"""

import numpy as np

from relform_controller.compiled import CompiledFunction
from relform_controller.ocp import layout
from relform_controller.ocp.frames import rotation_z, rotations_z
from relform_controller.ocp.problem import Disturbances, HorizonStart, Ocp, Plan, TeamGeometry
from relform_core.arrays import Array


def hover_plan(start: HorizonStart, hover_thrust: float, n_stages: int) -> Plan:
    """The first guess of a flight: a hover at the given states.

    Args:
        start: how the vehicles are.
        hover_thrust: thrust of each rotor [N].
        n_stages: length N of the horizon.
    """
    states = np.repeat(start.states[:, None], n_stages + 1, axis=1)
    thrusts = np.full((len(states), n_stages, layout.N_INPUT), hover_thrust)
    return Plan(states, thrusts, start.rotors)


def shift(plan: Plan, predict: CompiledFunction, ocp: Ocp) -> Plan:
    """The plan one control period later; the last input is held.

    If a stage is longer than a period, each new stage covers the end of one old stage and the begin of the
    next, and its input is their mean over time.

    Args:
        plan: at stages 0..N.
        predict: (state, mean thrusts) -> (state one control period later,), of all vehicles.
        ocp: the problem that it solves.
    """
    share = ocp.period / ocp.stage
    following_thrusts = np.concatenate([plan.thrusts[:, 1:], plan.thrusts[:, -1:]], axis=1)
    rotor_thrusts, lag = plan.rotor_thrusts(ocp.stage), plan.rotors.lag
    following_rotors = plan.rotors.after(plan.thrusts[:, 0], ocp.period)

    def period_later(stage: int) -> Array:
        commands = plan.thrusts[:, min(stage, ocp.n_stages - 1)]
        (following,) = predict(plan.states[:, stage], lag.mean(rotor_thrusts[:, stage], commands, ocp.period))
        return following

    if share == 1.0:
        states = np.concatenate([plan.states[:, 1:], period_later(ocp.n_stages)[:, None]], axis=1)
        return Plan(states, following_thrusts, following_rotors)
    states = np.empty_like(plan.states)
    for stage in range(states.shape[1]):
        states[:, stage] = period_later(stage)
    thrusts = plan.thrusts + share * (following_thrusts - plan.thrusts)
    return Plan(states, thrusts, following_rotors)


def transform(
    plan: Plan, geometry: TeamGeometry, pairs: tuple[tuple[int, int], ...]
) -> tuple[Plan, TeamGeometry]:
    """Express a plan, and the geometry it was made for, in the {mi} frames anchored at its own first
    states."""
    states = plan.states.copy()
    origin = plan.states[:, 0, layout.POSITION]  # p_IJ_I, of the next {mi} `J` in the present `I`
    yaw = plan.states[:, 0, layout.YAW]
    R_JI = rotations_z(-yaw)
    R_IJ = R_JI.swapaxes(1, 2)
    states[..., layout.POSITION] = (plan.states[..., layout.POSITION] - origin[:, None]) @ R_IJ
    states[..., layout.VELOCITY] = plan.states[..., layout.VELOCITY] @ R_IJ
    states[..., layout.YAW] -= yaw[:, None]
    i, j = np.array(pairs).T
    p_J2_I1 = geometry.p_I1I2_I1 + _each_turned(rotations_z(geometry.yaw_I1I2), origin[j])
    p_J1J2_J1 = _each_turned(R_JI[i], p_J2_I1 - origin[i])
    yaw_J1J2 = geometry.yaw_I1I2 + yaw[j] - yaw[i]
    next_geometry = TeamGeometry(
        p_I1I2_I1=p_J1J2_J1,
        yaw_I1I2=yaw_J1J2,
        p_NI_N=geometry.p_NI_N + rotation_z(geometry.yaw_NI) @ origin[0],
        yaw_NI=geometry.yaw_NI + float(yaw[0]),
        disturbances=_turned(geometry.disturbances, R_JI),
    )
    return Plan(states, plan.thrusts, plan.rotors), next_geometry


def _turned(disturbances: Disturbances | None, R_JI: Array) -> Disturbances | None:
    if disturbances is None:
        return None
    return Disturbances(_each_turned(R_JI, disturbances.acceleration_I), disturbances.thrust_scale)


def _each_turned(rotations: Array, vectors: Array) -> Array:
    """Each vector, shape (n, 3), by its own rotation, shape (n, 3, 3)."""
    turned: Array = (rotations @ vectors[..., None])[..., 0]
    return turned
