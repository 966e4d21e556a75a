"""What decides in a flight: the formation controller, with take-off and landing under a flight director."""

import math
import time
from collections.abc import Callable

from relform_controller.flight_director import FlightDirector
from relform_controller.formation_controller import FormationController
from relform_core.scenario_config import ScenarioConfig

TeamController = FormationController | FlightDirector
"""Both have steps, live weights and formations; only a director takes other requests."""


def make_controller(
    config: ScenarioConfig,
    clock: Callable[[], float] = time.perf_counter,
    time_budget: float = math.inf,
) -> TeamController:
    """The controller of a scenario.

    Args:
        config: with ``ground``, the controller takes off and lands.
        clock: monotonic time [s], for the solver's reports.
        time_budget: see ``FormationController``.
    """
    if config.ground is None:
        return FormationController(config, clock, time_budget=time_budget)
    return FlightDirector(config, clock, time_budget)
