"""Instances of the optimal control problem, and its residuals computed in the world with SciPy."""

from dataclasses import dataclass
from functools import cache

import casadi as ca
import numpy as np
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from relform_controller.ocp import layout
from relform_controller.ocp.model import RigidBody, rk4_step
from relform_controller.ocp.problem import HorizonReference, HorizonStart, Ocp, Plan, TeamGeometry
from relform_controller.ocp.rotor_lag import RotorLag, Rotors
from relform_controller.ocp.terms.registry import TERMS
from relform_controller.solver.kernel import KernelSolver
from relform_controller.solver.reference import ReferenceSolver
from relform_controller.solver.solver import Solver
from relform_core.scenario_config import ScenarioConfig
from support.scenarios import paper_scenario, team_of
from support.world import Array, random_team

HUMMINGBIRD = RigidBody.from_config(paper_scenario().config.vehicle)
ARMS = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Directions of the rotors front, left, back, right."""


@dataclass(frozen=True, eq=False)
class Poses:
    """The poses of the {mi} frames in the world."""

    p_NI_N: Array
    """Shape (vehicle, 3)."""
    yaw_NI: Array
    """Shape (vehicle,)."""

    def geometry(self) -> TeamGeometry:
        """The same team as an estimate of the controller."""
        pairs = layout.ordered_pairs(len(self.yaw_NI))
        p_I1I2_I1 = [self.levelled(i).inv().apply(self.p_NI_N[j] - self.p_NI_N[i]) for i, j in pairs]
        yaw_I1I2 = [self.yaw_NI[j] - self.yaw_NI[i] for i, j in pairs]
        return TeamGeometry(np.array(p_I1I2_I1), np.array(yaw_I1I2), self.p_NI_N[0], float(self.yaw_NI[0]))

    def levelled(self, vehicle: int) -> Rotation:
        """R_NI."""
        return Rotation.from_euler("z", self.yaw_NI[vehicle])


@dataclass(frozen=True, eq=False)
class Problem:
    """One instance of the optimal control problem."""

    config: ScenarioConfig
    poses: Poses
    initial_states: Array
    reference: HorizonReference
    applied_thrusts: Array
    rotor_thrusts: Array

    @property
    def start(self) -> HorizonStart:
        return HorizonStart(self.initial_states, self.rotors, self.applied_thrusts)

    @property
    def rotors(self) -> Rotors:
        return Rotors(RotorLag(self.config.vehicle.rotor_time_constant), self.rotor_thrusts)

    @property
    def ocp(self) -> Ocp:
        return Ocp.from_config(self.config)


def random_problem(seed: int, n_vehicles: int, *overrides: str, disturbance: float = 0.2) -> Problem:
    """A team that is tilted, turning and moving, and a reference that is ``disturbance`` metres off."""
    generator = np.random.default_rng(seed)
    config = _config(n_vehicles, overrides)
    ocp = Ocp.from_config(config)
    team = random_team(generator, n_vehicles, tilt_max=0.25, rate_max=0.5)
    poses = Poses(np.array([vehicle.p_NB_N for vehicle in team]), np.array([vehicle.yaw for vehicle in team]))
    time = np.arange(ocp.n_stages + 1)[:, None] * ocp.stage
    displacement = generator.uniform(-1.0, 1.0, (len(ocp.pairs), 3)) * disturbance
    drift = generator.uniform(-0.5, 0.5, 3)
    reference = HorizonReference(
        p_B1B2_C1=(poses.geometry().p_I1I2_I1 + displacement)[:, None] + np.sin(3.0 * time) * drift / 5.0,
        p_NB_N=team[0].p_NB_N + disturbance + time * (team[0].v_NB_N + drift),
        yaw_NB=team[0].yaw + disturbance + 0.8 * time[:, 0] ** 2,
    )
    applied, rotors = config.vehicle.hover_thrust + generator.uniform(
        -0.3, 0.3, (2, n_vehicles, layout.N_INPUT)
    )
    return Problem(
        config, poses, np.array([vehicle.state_I() for vehicle in team]), reference, applied, rotors
    )


SOLVERS = (KernelSolver, ReferenceSolver)


def solver_of(ocp: Ocp, kind: type[KernelSolver] | type[ReferenceSolver] = KernelSolver) -> Solver:
    """A solver of a problem with the terms of the registry."""
    return kind(ocp, TERMS)


@cache
def _config(n_vehicles: int, overrides: tuple[str, ...]) -> ScenarioConfig:
    return paper_scenario(*team_of(n_vehicles), *overrides).config


def random_thrusts_of_team(seed: int, ocp: Ocp, hover_thrust: float) -> Array:
    """Around hover, shape (vehicle, stage, N_INPUT)."""
    generator = np.random.default_rng(seed)
    return hover_thrust + generator.uniform(-0.25, 0.25, (ocp.n_vehicles, ocp.n_stages, layout.N_INPUT))


@cache
def _step(body: RigidBody, period: float, n_vehicles: int) -> ca.Function:
    x, u = ca.SX.sym("x", layout.N_STATE), ca.SX.sym("u", layout.N_INPUT)
    return ca.Function("step", [x, u], [rk4_step(x, u, body, period)]).map(n_vehicles)


def mean_thrusts(time_constant: float, stage: float, commands: Array, rotor_thrusts: Array) -> Array:
    """Of every stage, from the matrix exponential of the lag; shape (vehicle, stage, N_INPUT)."""
    if time_constant == 0.0:
        return commands
    # Thrust, its integral, and the command, over one stage.
    rates = np.array([[-1.0, 0.0, 1.0], [time_constant, 0.0, 0.0], [0.0, 0.0, 0.0]]) / time_constant
    (after, integral, _), thrusts, found = expm(rates * stage), rotor_thrusts, []
    for command in np.moveaxis(commands, 1, 0):
        found.append((integral[0] * thrusts + integral[2] * command) / stage)
        thrusts = after[0] * thrusts + after[2] * command
    return np.stack(found, axis=1)


def simulated_plan(problem: Problem, commands: Array, initial_states: Array | None = None) -> Plan:
    """A plan that obeys the dynamics, from the start of a problem or from other states."""
    states = problem.initial_states if initial_states is None else initial_states
    time_constant = problem.config.vehicle.rotor_time_constant
    means = mean_thrusts(time_constant, problem.ocp.stage, commands, problem.rotor_thrusts)
    return Plan(simulate(problem.ocp, states, means), commands, problem.rotors)


def simulate(ocp: Ocp, initial_states: Array, thrusts: Array) -> Array:
    """The states that follow from the mean thrusts, shape (vehicle, stage 0..N, N_STATE)."""
    step = _step(ocp.body, ocp.stage, ocp.n_vehicles)
    states = [initial_states]
    for stage in range(thrusts.shape[1]):
        states.append(np.array(step(states[-1].T, thrusts[:, stage].T)).T)
    return np.stack(states, axis=1)


def effects(body: RigidBody) -> Array:
    """Thrust divided by mass and angular accelerations by the thrusts, shape (4, 4)."""
    torques = np.cross(body.arm_length * ARMS, [0.0, 0.0, 1.0]).T
    torques[2] = body.torque_per_thrust * np.array([1.0, -1.0, 1.0, -1.0])
    return np.concatenate([np.full((1, 4), 1.0 / body.mass), torques / np.array(body.inertia)[:, None]])


def residual(
    problem: Problem, initial_states: Array, thrusts: Array, rotor_thrusts: Array | None = None
) -> Array:
    """All residuals of eqs. CostFunc1 and CostFunc2 after a simulation, unweighted, shape (row,).

    Row by row: formation by pair and stage 1..N, position and yaw of the leader by stage 1..N; acceleration,
    torque and change of thrust by vehicle and stage 0..N-1, the last two as a Hummingbird that accelerates
    alike has them.
    """
    ocp, poses = problem.ocp, problem.poses
    rotor_thrusts = problem.rotor_thrusts if rotor_thrusts is None else rotor_thrusts
    means = mean_thrusts(problem.config.vehicle.rotor_time_constant, ocp.stage, thrusts, rotor_thrusts)
    states = simulate(ocp, initial_states, means)
    p_NB_N = np.array(
        [
            poses.levelled(vehicle).apply(own[:, layout.POSITION]) + poses.p_NI_N[vehicle]
            for vehicle, own in enumerate(states)
        ]
    )
    yaw_NB = states[:, :, layout.YAW] + poses.yaw_NI[:, None]
    formation = [
        Rotation.from_euler("z", yaw_NB[i, :, None]).inv().apply(p_NB_N[j] - p_NB_N[i])
        - problem.reference.p_B1B2_C1[pair]
        for pair, (i, j) in enumerate(ocp.pairs)
    ]
    G, G0 = (effects(body) for body in (ocp.body, HUMMINGBIRD))
    total = means.sum(axis=2)
    R_IB = Rotation.from_euler("ZYX", states[:, :-1, layout.RPY].reshape(-1, 3)[:, ::-1])
    thrust_I = R_IB.apply(np.outer(total.reshape(-1), [0.0, 0.0, 1.0])) / ocp.body.mass
    v_IB_I = states[:, :-1, layout.VELOCITY].reshape(-1, 3)
    drag_I = R_IB.apply(np.array(ocp.body.drag) * R_IB.inv().apply(v_IB_I)) / ocp.body.mass
    torque = thrusts @ G[1:].T * HUMMINGBIRD.inertia
    before = np.concatenate([problem.applied_thrusts[:, None], thrusts[:, :-1]], axis=1)
    parts = [
        np.array(formation)[:, 1:],
        (p_NB_N[0] - problem.reference.p_NB_N)[1:],
        (yaw_NB[0] - problem.reference.yaw_NB)[1:],
        thrust_I - drag_I - [0.0, 0.0, 9.81],
        torque,
        (thrusts - before) @ np.linalg.solve(G0, G).T,
    ]
    return np.concatenate([np.asarray(part).reshape(-1) for part in parts])


def weights(problem: Problem) -> Array:
    """Of every row of `residual`: the cost is sum(weights * residual^2)."""
    ocp, w = problem.ocp, problem.config.controller.weights
    n, n_stages, n_pairs = ocp.n_vehicles, ocp.n_stages, len(ocp.pairs)
    last = np.ones(n_stages)
    last[-1] = w.terminal_scale
    return np.concatenate(
        [
            np.broadcast_to(2.0 / (n - 1) * w.formation * last[:, None], (n_pairs, n_stages, 3)).reshape(-1),
            np.broadcast_to(n / 3.0 * w.leader_position * last[:, None], (n_stages, 3)).reshape(-1),
            n / 3.0 * w.leader_yaw * last,
            np.full(n * n_stages * 3, w.acceleration),
            np.full(n * n_stages * 3, w.torque),
            np.full(n * n_stages * 4, w.thrust_rate),
        ]
    )
