"""Which nodes take part in a flight: vehicles, the controllers that command them, and observers."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from relform_core import names
from relform_core.errors import ConfigError
from relform_core.scenario_config import ScenarioConfig


@dataclass(frozen=True)
class Controller:
    """A controller of a flight, and the vehicles that it commands."""

    name: str
    """The namespace of its node and its topics, without slashes."""
    vehicles: tuple[str, ...]

    @property
    def node(self) -> str:
        """Fully qualified name of its node."""
        return f"/{self.name}/{names.CONTROLLER}"

    @property
    def state(self) -> str:
        """Topic of the team as it sees it."""
        return f"/{self.name}/{names.STATE_OF_CONTROLLER}"

    @property
    def solver(self) -> str:
        """Topic of its solver's reports."""
        return f"/{self.name}/{names.SOLVER_OF_CONTROLLER}"

    @property
    def reference(self) -> str:
        """Topic of what it is asked to track."""
        return f"/{self.name}/{names.REFERENCE_OF_CONTROLLER}"

    @property
    def status(self) -> str:
        """Topic of what the team does between the ground and the air."""
        return f"/{self.name}/{names.STATUS_OF_CONTROLLER}"

    @property
    def separation(self) -> str:
        """Topic of the distances between its vehicles."""
        return f"/{self.name}/{names.SEPARATION_OF_CONTROLLER}"

    @property
    def events(self) -> str:
        """Topic of its events and those of its vehicles."""
        return f"/{self.name}/{names.EVENTS_OF_CONTROLLER}"


@dataclass(frozen=True)
class Roster:
    """The nodes of a flight beside its clock.

    Raises:
        ConfigError: two controllers have the same name or that of a vehicle, or a vehicle does not have
            exactly one controller.
    """

    vehicles: tuple[str, ...]
    controllers: tuple[Controller, ...]
    observers: tuple[str, ...] = ()
    """Fully qualified names of nodes that read everything and command nothing, such as a recorder."""

    def __post_init__(self) -> None:
        namespaces = Counter((*self.vehicles, *(controller.name for controller in self.controllers)))
        for name, count in namespaces.items():
            if count > 1:
                raise ConfigError(f"controllers: the namespace '{name}' is used {count} times")
        commanded = Counter(vehicle for controller in self.controllers for vehicle in controller.vehicles)
        for vehicle in {**dict.fromkeys(self.vehicles), **commanded}:
            if vehicle not in self.vehicles:
                known = ", ".join(self.vehicles)
                raise ConfigError(f"controllers: unknown vehicle '{vehicle}', expected one of {known}")
            if commanded[vehicle] != 1:
                raise ConfigError(
                    f"controllers: exactly one must command '{vehicle}' (got {commanded[vehicle]})"
                )

    @classmethod
    def of(cls, config: ScenarioConfig, observers: Sequence[str] = ()) -> "Roster":
        """The roster of a scenario: one controller commands all its vehicles."""
        vehicles = config.team.vehicles
        return cls(vehicles, (Controller(names.FORMATION, vehicles),), tuple(observers))

    @property
    def members(self) -> tuple[str, ...]:
        """Fully qualified names of all nodes, observers last."""
        return (
            *map(names.vehicle_node, self.vehicles),
            *(controller.node for controller in self.controllers),
            *self.observers,
        )

    def commander(self, vehicle: str) -> Controller:
        """The controller that commands a vehicle."""
        return next(controller for controller in self.controllers if vehicle in controller.vehicles)

    def controller_at(self, node: str) -> Controller:
        """The controller that a node runs.

        Raises:
            ConfigError: the node is no controller of this flight.
        """
        for controller in self.controllers:
            if controller.node == node:
                return controller
        known = ", ".join(controller.node for controller in self.controllers)
        raise ConfigError(f"unknown node name {node}, expected one of {known}")
