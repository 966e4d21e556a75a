#!/usr/bin/env python3
"""An estimator of your own in the loop: raw feedback, with velocities that the prediction smooths.

`.venv/bin/python examples/own_estimator.py` flies a circle without and with it.
"""

import dataclasses
from collections.abc import Mapping

from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.simulate import fly_in_process
from relform_controller.estimation.estimator import AppliedInputs, TeamEstimate, Waiting
from relform_controller.estimation.raw import RawEstimator
from relform_controller.formation_controller import FormationController
from relform_controller.ocp import layout
from relform_controller.ocp.problem import Prediction
from relform_core.load import LoadedScenario, load_scenario
from relform_core.measurements import TeamMeasurements
from relform_core.scenario_config import ScenarioConfig

SHARE = 0.2
"""Of the measured velocity; the rest of the estimate is what the last plan predicts."""


class BlendingEstimator:
    """Raw feedback, in which the prediction smooths the velocities of the optic flow."""

    estimates_disturbances = False

    def __init__(self, config: ScenarioConfig) -> None:
        self._raw = RawEstimator(
            config.team.vehicles, config.controller.relative_yaw_std_max, config.controller.period
        )

    def update(
        self,
        measurements: TeamMeasurements,
        applied: Mapping[int, AppliedInputs],
        predicted: Prediction | None,
    ) -> TeamEstimate | Waiting:
        """The estimate at the instant of one control step, see ``Estimator``."""
        raw = self._raw.update(measurements, applied, predicted)
        if isinstance(raw, Waiting) or predicted is None:
            return raw
        states = raw.states.copy()
        states[:, layout.VELOCITY] *= SHARE
        states[:, layout.VELOCITY] += (1.0 - SHARE) * predicted.states[:, layout.VELOCITY]
        return dataclasses.replace(raw, states=states)


def formation_error(scenario: LoadedScenario, controller: FormationController) -> float:
    """Mean formation error in steady state [m]."""
    log = fly_in_process(scenario, controller)
    return flight_metrics(log).score.formation.steady.mean


def main() -> None:
    """Fly and print both errors."""
    scenario = load_scenario("circle", ["controller=retuned"], seed=1)
    config = scenario.config
    raw = formation_error(scenario, FormationController(config))
    own = formation_error(scenario, FormationController(config, estimator=BlendingEstimator(config)))
    print(f"formation error with raw feedback: {raw:.4f} m, with your estimator: {own:.4f} m")


if __name__ == "__main__":
    main()
