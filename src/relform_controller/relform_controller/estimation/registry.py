"""The estimators that ``controller.estimator`` may ask for."""

from relform_controller.estimation.estimator import Estimator
from relform_controller.estimation.raw import RawEstimator
from relform_controller.estimation.team import TeamEstimator
from relform_core.controller_config import RawEstimatorConfig
from relform_core.scenario_config import ScenarioConfig


def make_estimator(config: ScenarioConfig, *, is_at_rest: bool = True) -> Estimator:
    """The estimator that a scenario asks for, new.

    Args:
        is_at_rest: whether the vehicles hover at its first update; else they may move in any way.
    """
    controller = config.controller
    if isinstance(controller.estimator, RawEstimatorConfig):
        return RawEstimator(config.team.vehicles, controller.relative_yaw_std_max, controller.period)
    return TeamEstimator(config, is_at_rest=is_at_rest)
