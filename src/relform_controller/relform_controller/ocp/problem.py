"""The optimal control problem of the team (eq. OCP): dimensions, bounds on the inputs, and its data.

The data of one instance are a `Plan` (the unknowns), a `TeamGeometry` (where the {mi} frames lie, which the
paper calls parameters) and a `HorizonReference`. The terms of the cost are in `terms/`.
"""

from dataclasses import dataclass

import numpy as np

from relform_controller.ocp.constraints import NO_CONSTRAINTS, Constraints, make_constraints
from relform_controller.ocp.layout import ordered_pairs
from relform_controller.ocp.model import RigidBody
from relform_controller.ocp.rotor_lag import Rotors
from relform_core.arrays import Array
from relform_core.controller_config import FormationPairs, WeightsConfig
from relform_core.scenario_config import ScenarioConfig


@dataclass(frozen=True)
class Ocp:
    """Dimensions, model, weights and bounds."""

    n_vehicles: int
    n_stages: int
    period: float
    """Time from one command to the next [s]."""
    stage: float
    """Length of one stage [s], at least the period."""
    body: RigidBody
    weights: WeightsConfig
    """At the start of a flight."""
    thrust_min: float
    thrust_max: float
    """Bounds on the thrust of each rotor [N]."""
    formation_pairs: FormationPairs
    is_disturbed: bool = False
    """Whether the model takes disturbances into account, which the estimator must then estimate."""
    rotors_may_lag: bool = False
    """Whether the thrusts of the rotors are states, because their lag is known or may be found in flight."""
    constraints: Constraints = NO_CONSTRAINTS
    """Soft constraints."""

    @classmethod
    def from_config(cls, config: ScenarioConfig) -> "Ocp":
        """The problem that a scenario asks for."""
        vehicle = config.vehicle
        return cls(
            n_vehicles=len(config.team.vehicles),
            n_stages=config.controller.horizon_steps,
            period=config.controller.period,
            stage=config.controller.stage_length,
            body=RigidBody.from_config(vehicle),
            weights=config.controller.weights,
            thrust_min=vehicle.thrust_coefficient * vehicle.rotor_speed_min**2,
            thrust_max=vehicle.thrust_coefficient * vehicle.rotor_speed_max**2,
            formation_pairs=config.controller.formation_pairs,
            rotors_may_lag=config.rotors_may_lag,
            constraints=make_constraints(
                config.controller.constraints, config.obstacles, config.team.vehicles
            ),
        )

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Ordered pairs (observer, target); the axis `pair` of every array runs over these."""
        return ordered_pairs(self.n_vehicles)

    def in_formation_cost(self, observer: int, target: int) -> bool:
        """Whether eq. CostFunc1 has a term for this ordered pair."""
        match self.formation_pairs:
            case "all":
                return True
            case "with_leader":
                return observer == 0 or target == 0
            case "one_way":
                return observer < target


@dataclass(frozen=True, eq=False)
class Plan:
    """States and inputs of every vehicle over the horizon, each in its own {mi}."""

    states: Array
    """Shape (vehicle, stage 0..N, N_STATE)."""
    thrusts: Array
    """Commands [N], shape (vehicle, stage 0..N-1, N_INPUT)."""
    rotors: Rotors
    """At the start of the horizon; their thrusts follow the commands from there."""

    def rotor_thrusts(self, stage: float) -> Array:
        """Thrusts of the rotors at stages 0..N, each ``stage`` seconds long [N].

        Shape (vehicle, stage 0..N, N_INPUT).
        """
        return self.rotors.lag.sequence(self.rotors.thrusts, self.thrusts, stage)


@dataclass(frozen=True, eq=False)
class Disturbances:
    """What acts on the vehicles beside the nominal model, constant over the horizon."""

    acceleration_I: Array
    """From unknown forces, in each vehicle's {mi} [m/s^2], shape (vehicle, 3)."""
    thrust_scale: Array
    """True thrust over nominal thrust, shape (vehicle,)."""

    @property
    def inputs(self) -> Array:
        """As the kernels take them: acceleration, then thrust scale, shape (vehicle, 4)."""
        return np.concatenate([self.acceleration_I, self.thrust_scale[:, None]], axis=1)


@dataclass(frozen=True, eq=False)
class TeamGeometry:
    """Where the {mi} frames lie relative to each other, and the leader's in the world."""

    p_I1I2_I1: Array
    """Origin of the target's {mi} in the observer's [m], shape (pair, 3)."""
    yaw_I1I2: Array
    """Yaw of the target's {mi} relative to the observer's, `R_I1I2 = R_z(yaw_I1I2)` [rad], shape (pair,)."""
    p_NI_N: Array
    """Origin of the leader's {mi} in the world [m], shape (3,)."""
    yaw_NI: float
    """Yaw of the leader's {mi} in the world, unwrapped to lie near its reference [rad]."""
    disturbances: Disturbances | None = None
    """None: the estimator knows of none."""


@dataclass(frozen=True, eq=False)
class HorizonStart:
    """What is known of the vehicles at the start of the horizon."""

    states: Array
    """Each in its own {mi}, shape (vehicle, N_STATE)."""
    rotors: Rotors
    applied_thrusts: Array
    """Inputs of the interval before the horizon [N], shape (vehicle, N_INPUT)."""


@dataclass(frozen=True, eq=False)
class Prediction:
    """What the last plan predicts for the next control step, in the {mi} frames that it predicts."""

    states: Array
    """Shape (vehicle, N_STATE); position and yaw are zero."""
    geometry: TeamGeometry


@dataclass(frozen=True, eq=False)
class HorizonReference:
    """What the plan should track."""

    p_B1B2_C1: Array
    """Formation: position of the target in {mc} of the observer [m], shape (pair, stage 0..N, 3)."""
    p_NB_N: Array
    """Leader position [m], shape (stage 0..N, 3)."""
    yaw_NB: Array
    """Leader yaw, continuous [rad], shape (stage 0..N,)."""
