#!/usr/bin/env python3
"""Simulator, estimator and controller in one process, without ROS."""

from relform_controller.formation_controller import FormationController
from relform_core.load import load_scenario
from relform_sim.team import SimulatedTeam

scenario = load_scenario("circle", seed=1)
team = SimulatedTeam(scenario.config, scenario.seed)
controller = FormationController(scenario.config)

measurements = team.step()
for _ in range(scenario.config.n_steps):
    decision = controller.step(measurements)  # estimate and plan: measurements in, commands out
    measurements = team.step(decision.commands)  # fly and measure: commands in, measurements out

for name, truth in team.ground_truth.items():
    print(f"{name} ends at {truth.p_NB_N.round(2)} m")
