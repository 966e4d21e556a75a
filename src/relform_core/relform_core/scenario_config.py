"""Schema of ``config/scenarios/*.yaml``: team, formations, phases and disturbances of a flight."""

import bisect
import itertools
import math
from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from relform_core.constraints_config import Obstacle
from relform_core.controller_config import ControllerConfig, TeamEstimatorConfig
from relform_core.events_config import CommandLoss, Dropout, Event, LinkFault, LocalizationJump, Occlusion
from relform_core.formations_config import FormationConfig
from relform_core.geofence_config import GeofenceConfig
from relform_core.ground_config import CLIMB_MIN, GroundConfig, take_off_problem
from relform_core.heights import height_problem
from relform_core.in_file import InFile
from relform_core.links_config import LinksConfig
from relform_core.pacing_config import LOCKSTEP, PacingConfig, RealTimePacingConfig
from relform_core.phases_config import PhaseConfig, path_from_motion
from relform_core.schema import Label, Name, Schema, Vector3
from relform_core.sensing_config import CompleteSensing, SensingConfig, sensing_edges
from relform_core.sensors.applied_rotor_speeds import APPLIED_ROTOR_SPEEDS
from relform_core.sensors.flight_status import FLIGHT_STATUS
from relform_core.sensors.localization import LOCALIZATION
from relform_core.sensors.registry import SENSORS
from relform_core.sensors.sensor import Sensor, Source
from relform_core.sensors.sonar import SONAR
from relform_core.sensors_config import SensorsConfig
from relform_core.separation_config import SeparationConfig
from relform_core.simulation_config import LockstepConfig, PlantConfig
from relform_core.start_config import PLACE_MAX, StartConfig
from relform_core.team_config import TeamConfig, check_known
from relform_core.units import seconds_to_ns
from relform_core.vehicle_config import VehicleConfig


class ScenarioConfig(Schema):
    """Everything that defines a flight, except its seed."""

    name: Annotated[Name, Field(examples=["paper"])]
    """Name of the scenario."""
    title: Annotated[Label, Field(examples=["A flight of three"])]
    """What is flown, for people to read."""
    vehicle: Annotated[VehicleConfig, InFile("../vehicles/hummingbird.yaml")]
    """Type of all vehicles: a vehicle file, or its keys."""
    sensors: Annotated[SensorsConfig, InFile("../sensors/paper.yaml")]
    """Sensors of all vehicles: a sensors file, or its keys."""
    controller: Annotated[ControllerConfig, InFile("../controller/team.yaml")]
    """The controller: a controller file, or its keys."""
    team: TeamConfig
    """Names of the vehicles."""
    formations: Annotated[dict[Name, FormationConfig], Field(alias="formations_m", min_length=1)]
    """Position of each follower relative to the leader in the leader's control frame {mc}, by formation and
    name."""
    sensing: Annotated[SensingConfig, Field(examples=["ring"])] = CompleteSensing(kind="complete")
    """Which vehicles see each other, if they are in range and in view, as a mapping with its ``kind``, or the
    kind alone."""
    start: StartConfig
    """Where the team starts."""
    ground: GroundConfig | None = None
    """Take-off and landing; null: the vehicles start airborne."""
    phases: Annotated[tuple[PhaseConfig, ...], Field(min_length=1)]
    """The parts of the flight, one after the other."""
    events: tuple[Event, ...]
    """Disturbances of single vehicles; ``[]``: none."""
    links: LinksConfig = LinksConfig()
    """Radio links between each vehicle and the controller."""
    obstacles: tuple[Obstacle, ...] = ()
    """What the vehicles must not fly into."""
    plant: PlantConfig
    """How the motion of the vehicles is simulated."""
    lockstep: LockstepConfig
    """How nodes wait for each other."""
    pacing: Annotated[PacingConfig, Field(examples=["real_time"])] = LOCKSTEP
    """When a control step begins, as a mapping with its ``kind``, or the kind alone."""
    geofence: GeofenceConfig | None = None
    """Where the vehicles may fly; null: everywhere."""
    separation: SeparationConfig | None = None
    """Watch over the distances of the vehicles in flight; null: none."""

    @property
    def real_time(self) -> RealTimePacingConfig | None:
        """How the flight keeps to the wall clock; None: it flies in lock-step."""
        return self.pacing if isinstance(self.pacing, RealTimePacingConfig) else None

    @property
    def landing(self) -> GroundConfig | None:
        """How vehicles land; None: in lock-step without ``ground``, where a flight ends in the air."""
        return GroundConfig() if self.ground is None and self.real_time is not None else self.ground

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
        """Length of all phases [s], and of the flight if it starts airborne."""
        return self.phase_start_times[-1] + self.phases[-1].duration

    @property
    def n_steps(self) -> int:
        """Number of control steps; the last one is computed one period before the end."""
        duration = self.duration if self.ground is None else self.ground.time
        return round(duration / self.controller.period)

    @property
    def period_ns(self) -> int:
        """Control period in integer nanoseconds."""
        return seconds_to_ns(self.controller.period)

    @property
    def command_lead_steps(self) -> int:
        """Control periods from a decision to the interval that it is for: the longest known delay of a
        command, rounded up."""
        return -(-seconds_to_ns(self.links.down.delay_max) // self.period_ns)

    @property
    def command_lead_ns(self) -> int:
        """The same in nanoseconds."""
        return self.command_lead_steps * self.period_ns

    @property
    def rotors_may_lag(self) -> bool:
        """Whether the rotors are known to lag, or may be found to."""
        estimator = self.controller.estimator
        finds_lag = isinstance(estimator, TeamEstimatorConfig) and estimator.finds_rotor_lag
        return self.vehicle.rotor_time_constant > 0.0 or finds_lag

    @property
    def acknowledges_commands(self) -> bool:
        """Whether the vehicles report what they have flown: only where it can differ from the commands."""
        return (
            self.ground is not None
            or self.real_time is not None
            or self.geofence is not None
            or (self.separation is not None and self.separation.reaction == "evade")
            or not self.links.are_perfect
            or any(isinstance(event, CommandLoss | LinkFault) for event in self.events)
        )

    def sources_of(self, vehicle: str) -> tuple[Source[Any], ...]:
        """What a vehicle of the team sends to the controller, in the order in which it sends."""
        acknowledgement = (APPLIED_ROTOR_SPEEDS,) if self.acknowledges_commands else ()
        status = () if self.landing is None else (FLIGHT_STATUS,)
        return (*self.sensors_of(vehicle), *acknowledgement, *status)

    @property
    def start_places(self) -> Mapping[str, Vector3]:
        """Places of the first formation in the world [m], in team order: where the vehicles start, or to
        which they take off."""
        x, y, z = self.start.position
        cosine, sine = math.cos(self.start.yaw), math.sin(self.start.yaw)
        first = self.formations[self.phases[0].formation]
        places = {self.team.leader: self.start.position}
        for name in self.team.followers:
            forward, left, up = first[name]
            places[name] = (x + cosine * forward - sine * left, y + sine * forward + cosine * left, z + up)
        return places

    @property
    def true_vehicle(self) -> VehicleConfig:
        """The vehicle with the lag and drag of the plant; mass and inertia are still nominal."""
        of_plant = {
            "rotor_time_constant": self.plant.rotor_time_constant,
            "drag_coefficient": self.plant.drag_coefficient,
        }
        changes = {key: value for key, value in of_plant.items() if value is not None}
        return self.vehicle.model_copy(update=changes)

    def sensors_of(self, vehicle: str) -> tuple[Sensor[Any, Any], ...]:
        """The sensors that a vehicle of the team carries, in the order of their registration."""
        is_leader = vehicle == self.team.leader
        return tuple(
            sensor for sensor in SENSORS if self.sensors.has(sensor) and (is_leader or not sensor.leader_only)
        )

    @cached_property
    def targets_of(self) -> Mapping[str, tuple[str, ...]]:
        """The vehicles that each vehicle may see, in team order.

        Raises:
            ValueError: the sensing graph is impossible; never after validation.
        """
        vehicles = self.team.vehicles
        first = self.formations[self.phases[0].formation]
        places = np.array([(0.0, 0.0, 0.0), *(first[name] for name in self.team.followers)])
        edges = sensing_edges(self.sensing, vehicles, places)
        return {
            observer: tuple(target for j, target in enumerate(vehicles) if (min(i, j), max(i, j)) in edges)
            for i, observer in enumerate(vehicles)
        }

    def events_on(self, vehicle: str) -> tuple[Event, ...]:
        """The events that hit a vehicle, in the order of the scenario."""
        return tuple(event for event in self.events if event.target == vehicle)

    def formation_problem(self, formation: Mapping[str, Vector3]) -> str | None:
        """Why the team cannot fly a formation, as the end of a sentence about it; None if it can."""
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
        needed, reason = self.vehicle.separation_min, ""
        if self.separation is not None:
            needed, reason = self.separation.warning, " (separation.warning_m)"
        for (a, p_a), (b, p_b) in itertools.combinations(positions.items(), 2):
            if (separation := math.dist(p_a, p_b)) < needed:
                return (
                    f"is impossible: '{a}' and '{b}' are {separation:.3f} m apart, "
                    f"at least {needed:.3f} m are needed{reason}"
                )
        return None

    @model_validator(mode="after")
    def _formations_possible(self) -> Self:
        for name, formation in self.formations.items():
            if problem := self.formation_problem(formation):
                raise ValueError(f"formation '{name}' {problem}")
        return self

    @model_validator(mode="after")
    def _separation_noticed_in_time(self) -> Self:
        collision = self.vehicle.separation_min
        if self.separation is not None and self.separation.emergency <= collision:
            raise ValueError(
                f"separation.emergency_m {self.separation.emergency} must be more than {collision:g} m, at "
                "which vehicles collide (2 x vehicle.collision_radius_m)"
            )
        return self

    @model_validator(mode="after")
    def _starts_inside(self) -> Self:
        if self.geofence is None or self.phases[0].formation not in self.formations:
            return self
        if self.geofence.reaction == "land" and self.ground is None:
            raise ValueError("geofence.reaction 'land' needs a section 'ground'; or choose 'hold'")
        for name, place in self.start_places.items():
            if breach := self.geofence.breach(np.array(place), self.geofence.margin):
                raise ValueError(f"start: '{name}' would be outside the geofence: {breach}")
        return self

    @model_validator(mode="after")
    def _take_off_possible(self) -> Self:
        if self.ground is not None and self.phases[0].formation in self.formations:
            height_min = CLIMB_MIN + max(self.sensors.of(SONAR).range_min, self.vehicle.leg_height)
            problem = take_off_problem(self.start_places, self.vehicle.separation_min, height_min)
            if problem is not None:
                raise ValueError(f"start: {problem}")
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
        if moving := path_from_motion(self.phases):
            raise ValueError(
                f"phase '{moving.name}' must start at rest for its motion '{moving.motion.kind}': "
                "hover before, with a ramp_s within duration_s"
            )
        if problem := height_problem(self.start, self.phases, self.formations):
            raise ValueError(problem)
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
    def _sensing_possible(self) -> Self:
        for vehicle, targets in self.targets_of.items():
            unseen = [other for other in self.team.vehicles if other not in (vehicle, *targets)]
            if unseen and self.controller.estimator.kind == "raw":
                raise ValueError(
                    f"sensing '{self.sensing.kind}' leaves out '{vehicle}' and '{unseen[0]}', but "
                    "controller.estimator 'raw' needs 'complete': choose 'team'"
                )
        return self

    @model_validator(mode="after")
    def _event_targets_exist(self) -> Self:
        for event in self.events:
            check_known(f"event '{event.kind}' targets", event.target, self.team.vehicles)
            if isinstance(event, Occlusion) and event.hidden not in set(self.team.vehicles) - {event.target}:
                raise ValueError(
                    f"event 'occlusion' hides '{event.hidden}' from '{event.target}', "
                    "which is no other vehicle of the team"
                )
            if isinstance(event, Dropout):
                self._check_carried(event.kind, event.target, event.sensor)
            if isinstance(event, LocalizationJump):
                self._check_carried(event.kind, event.target, LOCALIZATION.name)
        return self

    @model_validator(mode="after")
    def _viewed_pairs_exist(self) -> Self:
        view = self.controller.constraints.field_of_view
        for observer, target in () if view is None else view.pairs:
            for name in (observer, target):
                check_known("controller.constraints.field_of_view names", name, self.team.vehicles)
            if observer == target:
                raise ValueError(f"controller.constraints.field_of_view: '{observer}' cannot observe itself")
        return self

    def _check_carried(self, event: str, vehicle: str, name: str) -> None:
        """Raise ValueError if a vehicle does not carry the sensor that an event of this kind acts on."""
        if name not in {sensor.name for sensor in self.sensors_of(vehicle)}:
            is_configured = getattr(self.sensors, name) is not None
            reason = "only the leader has" if is_configured else f"sensors.{name} is not configured"
            raise ValueError(f"event '{event}': '{vehicle}' has no {name}, {reason}")
