"""The live values of the controller: weights of the cost, and the formation."""

from collections.abc import Callable, Mapping

from relform_core.controller_config import ControllerConfig, WeightsConfig
from relform_core.errors import ConfigError
from relform_core.live_values import LiveSection, LiveValue, Value, section_keys
from relform_core.load import LoadedScenario
from relform_core.scenario_config import ScenarioConfig
from relform_core.schema import Vector3

FORMATION = "formation."
"""Prefix of the keys of the formation; the name of a follower follows."""

CheckFormation = Callable[[Mapping[str, Vector3]], None]
"""Raises a ConfigError for a formation that the team cannot fly from the next step on."""


class LiveControllerValues:
    """``weights.<key>`` as in the controller's configuration, ``formation.<follower>`` as in a formation."""

    def __init__(
        self,
        scenario: ScenarioConfig,
        controller: LiveSection[ControllerConfig],
        formation: Mapping[str, Vector3],
        check_formation: CheckFormation,
    ) -> None:
        """Use ``from_scenario``."""
        self._scenario = scenario
        self._controller = controller
        self.formation = formation
        """Position of each follower relative to the leader [m]."""
        self._check_formation = check_formation

    @classmethod
    def from_scenario(
        cls, scenario: LoadedScenario, check_formation: CheckFormation
    ) -> "LiveControllerValues":
        """The values that a scenario starts with.

        Args:
            scenario: names weights and formation.
            check_formation: the one check of a new formation, normally that of the flight's mission.
        """
        config = scenario.config
        keys = section_keys("weights", WeightsConfig)
        return cls(
            config,
            LiveSection(ControllerConfig, scenario.written["controller"], keys),
            config.formations[config.phases[0].formation],
            check_formation,
        )

    @property
    def weights(self) -> WeightsConfig:
        """Weights of the cost."""
        return self._controller.config.weights

    @property
    def described(self) -> Mapping[str, LiveValue]:
        """Description of each value, by dotted key."""
        apart = f"any two vehicles at least {self._scenario.vehicle.separation_min:g} m apart"
        place = LiveValue(
            description=ScenarioConfig.model_fields["formations"].description or "",
            constraint=f"3 finite numbers, {apart}, on the way to it too",
        )
        return {**self._controller.described, **dict.fromkeys(map(formation_key, self.formation), place)}

    @property
    def values(self) -> Mapping[str, Value]:
        """The present values, by dotted key."""
        return {**self._controller.values, **by_formation_key(self.formation)}

    def changed(self, changes: Mapping[str, Value]) -> "LiveControllerValues":
        """A copy with other values for some keys.

        Raises:
            ConfigError: one line: the key, its bound and the refused value.
        """
        weights = {key: value for key, value in changes.items() if not key.startswith(FORMATION)}
        formation = dict(self.formation)
        for key, value in changes.items():
            if key.startswith(FORMATION):
                formation[key.removeprefix(FORMATION)] = _place(key, value)
        if formation != self.formation:
            self._check_formation(formation)
        controller = self._controller.changed(weights)
        return LiveControllerValues(self._scenario, controller, formation, self._check_formation)


def formation_key(follower: str) -> str:
    """The key of the place of a follower."""
    return f"{FORMATION}{follower}"


def by_formation_key(formation: Mapping[str, Vector3]) -> dict[str, Value]:
    """The places of a formation by their keys."""
    return {formation_key(follower): place for follower, place in formation.items()}


def _place(key: str, value: Value) -> Vector3:
    if not isinstance(value, tuple) or len(value) != 3:
        shown = value if not isinstance(value, tuple) else list(value)
        raise ConfigError(f"{key}: must be a list of 3 numbers (got {shown})")
    x, y, z = value
    return x, y, z
