"""The estimators by the names that ``controller.estimator`` may have."""

from collections.abc import Callable, Mapping

from relform_controller.estimation.estimator import Estimator
from relform_controller.estimation.raw import RawEstimator
from relform_controller.estimation.team import TeamEstimator
from relform_core.controller_config import EstimatorName
from relform_core.scenario_config import ScenarioConfig


def _raw(config: ScenarioConfig) -> Estimator:
    return RawEstimator(
        config.team.vehicles, config.controller.relative_yaw_std_max, config.controller.period
    )


ESTIMATORS: Mapping[EstimatorName, Callable[[ScenarioConfig], Estimator]] = {
    "raw": _raw,
    "team": TeamEstimator,
}


def make_estimator(config: ScenarioConfig) -> Estimator:
    """The estimator that a scenario asks for, new."""
    return ESTIMATORS[config.controller.estimator](config)
