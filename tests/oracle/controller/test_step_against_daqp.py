"""Steps of recorded flights with many active bounds, against DAQP on a QP that this test condenses itself."""

from dataclasses import dataclass

import casadi as ca
import daqp
import numpy as np
import pytest

from relform_analysis.bench.streams import Instance, record, scenario_of
from relform_analysis.bench.team_problem import TeamProblem
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.terms.registry import TERMS
from relform_controller.solver.make import make_solver
from relform_core.arrays import Array

CHEAP_EFFORT = ("controller.weights.acceleration_per_m2_s4=0.001", "controller.weights.torque_per_n2_m2=5")
"""Overrides with which noise drives the thrusts to their bounds."""
TURN = 6.0
"""When the agile turn begins [s]."""


@dataclass(frozen=True, eq=False)
class BoxQp:
    """min 1/2 x' H x + g' x within bounds, over the change of all inputs, stage by stage."""

    H: Array
    g: Array
    lower: Array
    upper: Array


class Condenser:
    """The QP of an instance, from the model and the terms of the cost."""

    def __init__(self, ocp: Ocp) -> None:
        self.ocp, self.team = ocp, TeamProblem(ocp, TERMS)
        team = self.team
        by = ca.vertcat(team.z, team.u)
        self.stages = [
            ca.Function("stage", [team.z, team.u, team.p], [residual, ca.jacobian(residual, by)])
            for residual in (team.first_residual, team.residual, team.last_residual)
        ]
        following = [team.following, ca.jacobian(team.following, team.z), ca.jacobian(team.following, team.u)]
        self.following = ca.Function("following", [team.z, team.u, team.p], following)

    def qp(self, instance: Instance) -> BoxQp:
        states, inputs = self.team.guess(instance)
        parameters = self.team.parameters(instance)
        N, nu, nz = self.ocp.n_stages, inputs[0].size, states[0].size
        # Change of the state of a stage: offset + slope @ x.
        offset, slope = self.team.start(instance) - states[0], np.zeros((nz, N * nu))
        H, g = np.zeros((N * nu, N * nu)), np.zeros(N * nu)
        for k in range(N + 1):
            function = self.stages[0 if k == 0 else 2 if k == N else 1]
            u = inputs[k] if k < N else np.zeros(nu)
            residual, jacobian = (np.array(out) for out in function(states[k], u, parameters[k]))
            J = jacobian[:, :nz] @ slope
            if k < N:
                J[:, k * nu : (k + 1) * nu] += jacobian[:, nz:]
            H += 2.0 * J.T @ J
            g += 2.0 * J.T @ (residual[:, 0] + jacobian[:, :nz] @ offset)
            if k < N:
                following, A, B = (np.array(out) for out in self.following(states[k], u, parameters[k]))
                offset = A @ offset + following[:, 0] - states[k + 1]
                slope = A @ slope
                slope[:, k * nu : (k + 1) * nu] += B
        thrusts = np.concatenate(inputs)
        return BoxQp(H, g, self.ocp.thrust_min - thrusts, self.ocp.thrust_max - thrusts)

    def first_inputs(self, instance: Instance) -> Array:
        """By DAQP [N], shape (vehicle, N_INPUT)."""
        qp = self.qp(instance)
        # Scaled to a unit diagonal, so that the tolerances mean the same for every input.
        scale = 1.0 / np.sqrt(np.diag(qp.H))
        H, g = scale[:, None] * qp.H * scale, scale * qp.g
        no_rows = np.zeros((0, scale.size))
        x, _, flag, _ = daqp.solve(
            H, g, no_rows, qp.upper / scale, qp.lower / scale, primal_tol=1e-11, dual_tol=1e-11
        )
        assert flag == 1
        first = instance.guess.thrusts[:, 0]
        return first + (scale * x)[: first.size].reshape(first.shape)


@pytest.mark.parametrize(("n_vehicles", "n_instances", "active_max"), [(3, 200, 30), (8, 10, 50)])
def test_first_inputs_with_many_active_bounds(n_vehicles: int, n_instances: int, active_max: int) -> None:
    stream = record(scenario_of(n_vehicles, "paper", CHEAP_EFFORT), n_instances, TURN)
    assert len(stream.instances) == n_instances
    active = [instance.active_bounds for instance in stream.instances]
    assert max(active) > active_max
    condenser, solver = Condenser(stream.ocp), make_solver(stream.ocp)
    for instance in stream.instances:
        solver.prepare(instance.guess, instance.geometry)
        step = solver.feedback(instance.start, instance.geometry, instance.reference)
        np.testing.assert_allclose(step.plan.thrusts[:, 0], condenser.first_inputs(instance), rtol=1e-6)


@pytest.mark.parametrize("controller", ["retuned", "team"])
def test_first_inputs_of_shipped_tunings(controller: str) -> None:
    overrides = ["controller.estimator.finds_rotor_lag=false"] if controller == "team" else []
    stream = record(scenario_of(3, controller, overrides), 20, TURN)
    condenser, solver = Condenser(stream.ocp), make_solver(stream.ocp)
    for instance in stream.instances:
        solver.prepare(instance.guess, instance.geometry)
        step = solver.feedback(instance.start, instance.geometry, instance.reference)
        np.testing.assert_allclose(step.plan.thrusts[:, 0], condenser.first_inputs(instance), rtol=1e-6)
