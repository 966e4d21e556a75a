"""Schema of ``config/scenarios/*.yaml``: team, formations, phases of a flight, and what disturbs it."""

import bisect
import itertools
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from relform_core.controller_config import ControllerConfig
from relform_core.schema import (
    Label,
    Name,
    NonNegative,
    Positive,
    Probability,
    Schema,
    Vector3,
)
from relform_core.sensors.registry import SENSORS
from relform_core.sensors.sensor import Sensor
from relform_core.sensors_config import SensorsConfig
from relform_core.units import DEGREES, seconds_to_ns
from relform_core.vehicle_config import VehicleConfig

FormationConfig = dict[Name, Vector3]
"""Position of each follower relative to the leader in {mc} of the leader [m], by follower name."""

PLACE_MAX = 1000.0
"""Bound on each coordinate of a place in a formation [m]; far beyond what sensors see."""

if TYPE_CHECKING:
    SensorName = str
else:
    SensorName = Literal[tuple(sensor.name for sensor in SENSORS)]


class TeamConfig(Schema):
    """Who flies. The team order, leader first, is the order of every axis over vehicles."""

    leader: Name
    followers: Annotated[tuple[Name, ...], Field(min_length=1)]

    @property
    def vehicles(self) -> tuple[Name, ...]:
        """Names of all vehicles in team order."""
        return (self.leader, *self.followers)

    @model_validator(mode="after")
    def _distinct(self) -> Self:
        for name in self.vehicles:
            if self.vehicles.count(name) > 1:
                raise ValueError(f"vehicle '{name}' is named twice")
        return self


class Hover(Schema):
    """Slow down to rest over ``ramp`` and stay."""

    kind: Literal["hover"]
    ramp: Annotated[NonNegative, Field(alias="ramp_s")]


class Straight(Schema):
    """Fly along the heading; the speed changes to ``speed`` over ``ramp``."""

    kind: Literal["straight"]
    speed: Annotated[NonNegative, Field(alias="speed_m_s")]
    ramp: Annotated[NonNegative, Field(alias="ramp_s")]


class Turn(Schema):
    """Turn by ``angle`` (positive: to the left) within ``turn`` at constant speed, then straight on."""

    kind: Literal["turn"]
    angle: Annotated[float, Field(alias="angle_deg", ge=-360.0, le=360.0), DEGREES]
    turn: Annotated[Positive, Field(alias="turn_s")]


class Spiral(Schema):
    """Circle at ``radius`` (positive: to the left) while climbing; ``speed`` includes the climb."""

    kind: Literal["spiral"]
    radius: Annotated[float, Field(alias="radius_m")]
    speed: Annotated[Positive, Field(alias="speed_m_s")]
    climb: Annotated[float, Field(alias="climb_m_s")]
    ramp: Annotated[NonNegative, Field(alias="ramp_s")]

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if abs(self.radius) < 0.1:
            raise ValueError(f"radius_m must be at least 0.1 in magnitude (got {self.radius})")
        if abs(self.climb) >= self.speed:
            raise ValueError(f"climb_m_s {self.climb} must be less than speed_m_s {self.speed} in magnitude")
        return self


Motion = Annotated[Hover | Straight | Turn | Spiral, Field(discriminator="kind")]


class PhaseConfig(Schema):
    """A stretch of the flight: one motion of the leader, whose yaw follows the heading, one formation."""

    name: Label
    title: Label
    duration: Annotated[Positive, Field(alias="duration_s")]
    steady_from: Annotated[NonNegative, Field(alias="steady_from_s")]
    """Start of the steady-state window that is scored, from the start of the phase [s]."""
    formation: Name
    formation_step: bool = False
    """Whether a new formation applies at once, as in the paper; else it is blended in within the bounds of
    ``controller.formation_change``."""
    motion: Motion

    @model_validator(mode="after")
    def _window(self) -> Self:
        if self.steady_from >= self.duration:
            raise ValueError(f"steady_from_s {self.steady_from} must be less than duration_s {self.duration}")
        return self


class StartConfig(Schema):
    """Where the leader starts, airborne and at rest; followers start at their place beside it."""

    position: Annotated[Vector3, Field(alias="position_m")]
    yaw: Annotated[float, Field(alias="yaw_deg", ge=-180.0, le=180.0), DEGREES]


class _Event(Schema):
    """A disturbance of one vehicle between two instants, in seconds from the start of the flight."""

    start: Annotated[NonNegative, Field(alias="start_s")]
    end: Annotated[Positive, Field(alias="end_s")]
    target: Name

    def active(self, time: float) -> bool:
        """Whether the event acts at ``time`` [s]."""
        return self.start <= time < self.end

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.start >= self.end:
            raise ValueError(f"start_s {self.start} must be less than end_s {self.end}")
        return self


class Wind(_Event):
    """A constant force on the vehicle."""

    kind: Literal["wind"]
    force_N: Annotated[Vector3, Field(alias="force_n")]
    """In the world frame {n} [N]."""


class ThrustScale(_Event):
    """Every rotor's thrust and torque is multiplied by ``scale``."""

    kind: Literal["thrust_scale"]
    scale: Annotated[float, Field(gt=0.0, le=2.0)]


class Outliers(_Event):
    """Measured ranges and bearings are replaced by wrong ones with this probability."""

    kind: Literal["outliers"]
    probability: Probability
    range_std: Annotated[Positive, Field(alias="range_std_m")]
    bearing_std: Annotated[float, Field(alias="bearing_std_deg", gt=0.0, le=180.0), DEGREES]


class Dropout(_Event):
    """Messages of one sensor are not sent with this probability."""

    kind: Literal["dropout"]
    sensor: SensorName
    probability: Probability


class CommandLoss(_Event):
    """Commands do not reach the vehicle with this probability."""

    kind: Literal["command_loss"]
    probability: Probability


Event = Annotated[Wind | ThrustScale | Outliers | Dropout | CommandLoss, Field(discriminator="kind")]


class PlantConfig(Schema):
    """How the truth is integrated."""

    step: Annotated[float, Field(alias="step_s", gt=0.0, le=0.005)]


class LockstepConfig(Schema):
    """The barrier that keeps all nodes in the same step."""

    step_timeout: Annotated[Positive, Field(alias="step_timeout_s")]
    """Wall time that the slowest member may take for one step before the run is given up [s]."""
    on_vehicle_lost: Literal["abort"]


class ScenarioConfig(Schema):
    """Everything that defines a flight but its seed."""

    name: Name
    title: Label
    vehicle: VehicleConfig
    sensors: SensorsConfig
    controller: ControllerConfig
    team: TeamConfig
    formations: Annotated[dict[Name, FormationConfig], Field(alias="formations_m", min_length=1)]
    """Position of each follower relative to the leader in {mc} of the leader [m], by formation and name."""
    start: StartConfig
    phases: Annotated[tuple[PhaseConfig, ...], Field(min_length=1)]
    events: tuple[Event, ...]
    plant: PlantConfig
    lockstep: LockstepConfig

    @property
    def phase_start_times(self) -> tuple[float, ...]:
        """Time at which each phase starts [s]."""
        return tuple(itertools.accumulate((phase.duration for phase in self.phases[:-1]), initial=0.0))

    @property
    def phase_starts(self) -> tuple[int, ...]:
        """First control step of each phase."""
        return tuple(round(time / self.controller.period) for time in self.phase_start_times)

    def phase_index(self, step: int) -> int:
        """Index of the phase that a control step belongs to; after the end of the flight the last phase.

        Raises:
            ValueError: the step is negative.
        """
        if step < 0:
            raise ValueError(f"control steps start at 0 (got {step})")
        return bisect.bisect_right(self.phase_starts, step) - 1

    def phase_at(self, step: int) -> PhaseConfig:
        """The phase that a control step belongs to; after the end of the flight the last phase.

        Raises:
            ValueError: the step is negative.
        """
        return self.phases[self.phase_index(step)]

    @property
    def duration(self) -> float:
        """Length of the flight [s]."""
        return self.phase_start_times[-1] + self.phases[-1].duration

    @property
    def n_steps(self) -> int:
        """Number of control steps; the last one is computed one period before the end."""
        return round(self.duration / self.controller.period)

    @property
    def period_ns(self) -> int:
        """Control period in integer nanoseconds."""
        return seconds_to_ns(self.controller.period)

    def sensors_of(self, vehicle: str) -> tuple[Sensor[Any, Any], ...]:
        """The sensors that a vehicle of the team carries, in the order in which it sends."""
        is_leader = vehicle == self.team.leader
        return tuple(
            sensor for sensor in SENSORS if self.sensors.has(sensor) and (is_leader or not sensor.leader_only)
        )

    @property
    def separation_min(self) -> float:
        """Two vehicles collide when their centres are closer than this [m]."""
        return 2.0 * self.vehicle.collision_radius

    def formation_problem(self, formation: Mapping[str, Vector3]) -> str | None:
        """Why the team cannot fly a formation, as the end of a sentence on it; None if it can."""
        if unknown := sorted(set(formation) - set(self.team.followers)):
            known = ", ".join(self.team.followers)
            return f"names '{unknown[0]}', which is no follower; followers are {known}"
        if absent := [follower for follower in self.team.followers if follower not in formation]:
            return f"has no position for '{absent[0]}'"
        for follower, position in formation.items():
            if not all(map(math.isfinite, position)):
                return f"puts '{follower}' at {position}, which is not finite"
            if max(map(abs, position)) > PLACE_MAX:
                return f"puts '{follower}' at {position}, which is farther than {PLACE_MAX:g} m away"
        positions = {self.team.leader: (0.0, 0.0, 0.0), **formation}
        for (a, p_a), (b, p_b) in itertools.combinations(positions.items(), 2):
            if (separation := math.dist(p_a, p_b)) < self.separation_min:
                return (
                    f"is impossible: '{a}' and '{b}' are {separation:.3f} m apart, "
                    f"at least {self.separation_min:.3f} m are needed"
                )
        return None

    @model_validator(mode="after")
    def _formations_possible(self) -> Self:
        for name, formation in self.formations.items():
            if problem := self.formation_problem(formation):
                raise ValueError(f"formation '{name}' {problem}")
        return self

    @model_validator(mode="after")
    def _starts_airborne(self) -> Self:
        first = self.formations.get(self.phases[0].formation, {})
        lowest = self.start.position[2] + min([0.0, *(position[2] for position in first.values())])
        if lowest <= 0.0:
            raise ValueError(
                f"start.position_m puts a vehicle at {lowest:.3f} m above ground; flights start airborne"
            )
        return self

    @model_validator(mode="after")
    def _phases_consistent(self) -> Self:
        names = [phase.name for phase in self.phases]
        for phase in self.phases:
            if names.count(phase.name) > 1:
                raise ValueError(f"phase '{phase.name}' is named twice")
            if phase.formation not in self.formations:
                raise ValueError(
                    f"phase '{phase.name}' flies the unknown formation '{phase.formation}', "
                    f"known are {', '.join(sorted(self.formations))}"
                )
            steps = phase.duration / self.controller.period
            if not math.isclose(steps, round(steps), abs_tol=1e-6) or round(steps) < 1:
                raise ValueError(
                    f"phase '{phase.name}' lasts {phase.duration} s, not a multiple of controller.period_s "
                    f"{self.controller.period}"
                )
        return self

    @model_validator(mode="after")
    def _steps_divide_period(self) -> Self:
        substeps = self.controller.period / self.plant.step
        if not math.isclose(substeps, round(substeps), abs_tol=1e-6):
            raise ValueError(
                f"plant.step_s {self.plant.step} does not divide controller.period_s {self.controller.period}"
            )
        return self

    @model_validator(mode="after")
    def _events_hit_someone(self) -> Self:
        for event in self.events:
            if event.target not in self.team.vehicles:
                raise ValueError(
                    f"event '{event.kind}' targets the unknown vehicle '{event.target}', "
                    f"known are {', '.join(self.team.vehicles)}"
                )
            if isinstance(event, Dropout):
                self._check_carried(event.target, event.sensor)
        return self

    def _check_carried(self, vehicle: str, name: str) -> None:
        """Raise ValueError if a vehicle does not carry the sensor that a dropout of it names."""
        if name not in {sensor.name for sensor in self.sensors_of(vehicle)}:
            is_configured = getattr(self.sensors, name) is not None
            reason = "only the leader has" if is_configured else f"sensors.{name} is not configured"
            raise ValueError(f"event 'dropout': '{vehicle}' has no {name}, {reason}")
