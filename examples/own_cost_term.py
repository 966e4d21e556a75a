#!/usr/bin/env python3
"""A cost term of your own: vehicles that carry cameras pay for the rates of roll and pitch.

`.venv/bin/python examples/own_cost_term.py` flies a circle with raw feedback, without and with it.
"""

import functools
import math

import casadi as ca

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.simulate import fly_in_process
from relform_controller.formation_controller import FormationController
from relform_controller.ocp import layout
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.terms.registry import TERMS
from relform_controller.ocp.terms.term import VehicleStage, VehicleTerm
from relform_controller.solver.make import make_solver
from relform_core.load import load_scenario

WEIGHT = 0.1
"""Of the squared rates [s^2/rad^2]."""


def roll_and_pitch_rates(_: Ocp, stage: VehicleStage) -> ca.SX:
    """Of a vehicle in one stage of the horizon [rad/s]."""
    return stage.state[layout.RATE][:2]


CALM = VehicleTerm("calm", residual=roll_and_pitch_rates, weight=lambda _, weights: WEIGHT)


def fly(*terms: VehicleTerm) -> FlightLog:
    """A flight whose cost has some terms more."""
    scenario = load_scenario("circle", ["controller=retuned"], seed=1)
    solver = functools.partial(make_solver, terms=TERMS.plus(vehicle=terms))
    return fly_in_process(scenario, FormationController(scenario.config, solver=solver))


def mean_rate(log: FlightLog) -> float:
    """Of roll and pitch, root mean square over all vehicles [rad/s]."""
    return math.sqrt(float((log.w_NB_B[..., :2] ** 2).mean()))


def main() -> None:
    """Fly and print what the term changes."""
    for name, terms in (("without", ()), ("with", (CALM,))):
        log = fly(*terms)
        error = flight_metrics(log).score.formation.steady.mean
        print(f"{name} the term: roll and pitch at {mean_rate(log):.2f} rad/s, formation error {error:.4f} m")


if __name__ == "__main__":
    main()
