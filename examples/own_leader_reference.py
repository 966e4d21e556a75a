#!/usr/bin/env python3
"""A leader reference of your own: a circle that climbs and sinks, in place of the motions of a scenario.

`.venv/bin/python examples/own_leader_reference.py` flies it.
"""

import numpy as np

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.simulate import fly_in_process
from relform_controller.formation_controller import FormationController
from relform_controller.reference.mission import ScenarioMission
from relform_controller.reference.trajectory import LeaderReference
from relform_core.arrays import Array
from relform_core.load import load_scenario

RADIUS_M = 2.0
HEIGHT_M = 0.4
"""The leader climbs by twice this much, and sinks again, twice in each round."""
RATE_RAD_S = 0.6
RAMP_S = 2.0
"""The longer, the more gently the leader sets off."""


def rolling_circle(elapsed: Array) -> LeaderReference:
    """The leader at times since the start [s], shape (instant,); it starts at rest at (0, 0, 2) m."""
    angle = RATE_RAD_S * elapsed**2 / (elapsed + RAMP_S)
    rate = RATE_RAD_S * elapsed * (elapsed + 2.0 * RAMP_S) / (elapsed + RAMP_S) ** 2
    x, y = RADIUS_M * np.sin(angle), RADIUS_M * (1.0 - np.cos(angle))
    z = 2.0 + HEIGHT_M * (1.0 - np.cos(2.0 * angle))
    per_rad = np.stack(
        [RADIUS_M * np.cos(angle), RADIUS_M * np.sin(angle), 2.0 * HEIGHT_M * np.sin(2.0 * angle)], axis=1
    )
    return LeaderReference(np.stack([x, y, z], axis=1), per_rad * rate[:, None], yaw_NB=angle)


def fly() -> FlightLog:
    """A flight with the formation and the length of the scenario `circle`."""
    scenario = load_scenario("circle", seed=1)
    mission = ScenarioMission(scenario.config, leader=rolling_circle)
    return fly_in_process(scenario, FormationController(scenario.config, mission=mission))


def main() -> None:
    """Fly and print how well."""
    score = flight_metrics(fly()).score
    print(
        f"leader off its path by {score.leader_position.steady.mean:.3f} m, "
        f"formation error {score.formation.steady.mean:.4f} m"
    )


if __name__ == "__main__":
    main()
