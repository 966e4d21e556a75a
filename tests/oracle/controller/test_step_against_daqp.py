"""Steps of recorded flights with many active bounds and soft constraints, against DAQP on a condensed QP."""

import numpy as np
import pytest

from relform_analysis.bench.streams import record, scenario_of
from relform_controller.solver.kernel import KernelSolver
from relform_controller.solver.make import make_solver
from relform_controller.solver.reference import ReferenceSolver
from support.condensed import Condenser, solved
from support.problems import SOLVERS, solver_of

CHEAP_EFFORT = ("controller.weights.acceleration_per_m2_s4=0.001", "controller.weights.torque_per_n2_m2=5")
"""Overrides with which noise drives the thrusts to their bounds."""
TURN = 6.0
"""When the agile turn begins [s]."""


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


PRICES = "price_per_unit: 30, square_price_per_unit2: 100"
MANY_CONSTRAINTS = (
    "controller.constraints={"
    f"tilt: {{max_deg: 12, {PRICES}}}, speed: {{max_m_s: 1.9, {PRICES}}}, "
    f"separation: {{min_m: 1.3, {PRICES}}}, "
    "field_of_view: {axis_azimuth_deg: 10, axis_elevation_deg: 0, half_angle_deg: 40, range_max_m: 1.5, "
    f"pairs: [[follower_1, leader], [follower_2, leader]], {PRICES}}}, "
    f"keep_out: {{margin_m: 0.3, {PRICES}}}}}",
    "obstacles=[{kind: sphere, center_m: [9.5, 0.3, 2.0], radius_m: 0.3}, "
    "{kind: box, center_m: [10.0, 2.5, 1.0], size_m: [0.5, 0.5, 3.0], yaw_deg: 20.0}]",
)
"""Overrides: constraints that contradict each other and the mission, in force over the turn."""


@pytest.mark.parametrize("kind", SOLVERS)
@pytest.mark.parametrize("controller", ["paper", "team"])
def test_first_inputs_under_soft_constraints(
    controller: str, kind: type[KernelSolver] | type[ReferenceSolver]
) -> None:
    overrides = [*MANY_CONSTRAINTS, *CHEAP_EFFORT]
    if controller == "team":
        overrides.append("controller.estimator.finds_rotor_lag=false")
    stream = record(scenario_of(3, controller, overrides), 10, TURN)
    condenser, solver = Condenser(stream.ocp), solver_of(stream.ocp, kind)
    n_active = []
    for instance in stream.instances:
        solver.prepare(instance.guess, instance.geometry)
        step = solver.feedback(instance.start, instance.geometry, instance.reference)
        qp = condenser.qp(instance)
        x = solved(qp)
        n_active.append(np.count_nonzero(qp.C @ x + qp.c > -1e-9))
        thrusts = instance.guess.thrusts + x.reshape(stream.ocp.n_stages, 3, -1).swapaxes(0, 1)
        np.testing.assert_allclose(step.plan.thrusts[:, 0], thrusts[:, 0], rtol=1e-6)
        np.testing.assert_allclose(step.plan.thrusts, thrusts, atol=1e-4)
    assert min(n_active) > 10
