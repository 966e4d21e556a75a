"""What of the controller may be changed in flight: weights of the cost, and the formation."""

from collections.abc import Mapping

from relform_core.controller_config import ControllerConfig, WeightsConfig
from relform_core.errors import ConfigError
from relform_core.load import LoadedScenario
from relform_core.scenario_config import ScenarioConfig
from relform_core.schema import Vector3
from relform_core.tuning import SectionTuning, Tunable, Value, section_keys

FORMATION = "formation."
"""What the keys of the formation begin with; a follower's name comes next."""


class ControllerTuning:
    """``weights.<key>`` as in the controller's configuration, ``formation.<follower>`` as in a formation."""

    def __init__(
        self,
        scenario: ScenarioConfig,
        controller: SectionTuning[ControllerConfig],
        formation: Mapping[str, Vector3],
    ) -> None:
        """Use ``from_scenario``."""
        self._scenario = scenario
        self._controller = controller
        self.formation = formation
        """Position of each follower relative to the leader [m]."""

    @classmethod
    def from_scenario(cls, scenario: LoadedScenario) -> "ControllerTuning":
        """What a scenario starts with."""
        config = scenario.config
        keys = section_keys("weights", WeightsConfig)
        return cls(
            config,
            SectionTuning(ControllerConfig, scenario.written["controller"], keys),
            config.formations[config.phases[0].formation],
        )

    @property
    def weights(self) -> WeightsConfig:
        """Of the cost."""
        return self._controller.config.weights

    @property
    def tunables(self) -> Mapping[str, Tunable]:
        """What can be changed, by dotted key."""
        separation_min = 2.0 * self._scenario.vehicle.collision_radius
        place = Tunable(
            description=ScenarioConfig.model_fields["formations"].description or "",
            constraint=f"3 finite numbers, any two vehicles at least {separation_min:g} m apart",
        )
        return {**self._controller.tunables, **dict.fromkeys(map(formation_key, self.formation), place)}

    @property
    def values(self) -> Mapping[str, Value]:
        """What holds now, by dotted key."""
        return {**self._controller.values, **by_formation_key(self.formation)}

    def changed(self, changes: Mapping[str, Value]) -> "ControllerTuning":
        """All the same but for these values.

        Raises:
            ConfigError: one line: a key, what it must be, what it is.
        """
        weights = {key: value for key, value in changes.items() if not key.startswith(FORMATION)}
        formation = dict(self.formation)
        for key, value in changes.items():
            if key.startswith(FORMATION):
                formation[key.removeprefix(FORMATION)] = _place(key, value)
        if formation != self.formation and (problem := self._scenario.formation_problem(formation)):
            raise ConfigError(f"formation {problem}")
        return ControllerTuning(self._scenario, self._controller.changed(weights), formation)


def formation_key(follower: str) -> str:
    """The key of a follower's place."""
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
