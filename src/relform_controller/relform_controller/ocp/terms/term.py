"""A term of the cost: weighted squares of a residual, stage by stage, of each pair or vehicle.

The cost of the team is the sum of weight * residual^2 over all terms, items, stages and rows. A term gives
its residual and its derivatives by the states and inputs of single stages; the solver makes a quadratic
program of them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import casadi as ca

from relform_controller.ocp.problem import HorizonReference, Plan, TeamGeometry
from relform_core.arrays import Array, Integers
from relform_core.controller_config import WeightsConfig

CompiledFunction = Callable[..., tuple[Array, ...]]
"""A CasADi function that evaluates all its items; its outputs are valid until the next call."""


@dataclass(frozen=True, eq=False)
class NetAcceleration:
    """g + R_IB F_B / m of every vehicle at stage 0..N-1 and its derivatives, from the vehicle kernel."""

    value: Array
    """[m/s^2], shape (vehicle, stage, 3)."""
    by_states: Array
    """By ``states_of_acceleration``, shape (vehicle, stage, 3, state)."""
    by_thrusts: Array
    """Shape (vehicle, stage, 3, N_INPUT)."""


@dataclass(frozen=True, eq=False)
class Expansion:
    """What the residuals are linearised around."""

    guess: Plan
    geometry: TeamGeometry
    """Where the {mi} frames are predicted to be."""
    acceleration: NetAcceleration
    compiled: Mapping[str, CompiledFunction]
    """The functions of the terms, by name."""


@dataclass(frozen=True, eq=False)
class Instance:
    """What is known at feedback, and how far the states are from the guess."""

    state_deviation: Array
    """Shape (vehicle, stage 0..N, N_STATE)."""
    geometry: TeamGeometry
    """Where the {mi} frames are estimated to be."""
    reference: HorizonReference
    applied_thrusts: Array
    """Inputs of the interval before the horizon [N], shape (vehicle, N_INPUT)."""
    mean_thrust_deviation: Array | None = None
    """Of the mean thrusts in each stage [N], shape (vehicle, stage 0..N-1, N_INPUT); None: the rotors have no
    lag, so it is zero."""


@dataclass(frozen=True, eq=False)
class ByStates:
    """Derivatives of a residual by state components of one vehicle, at its own stage.

    A term has at most one of these per item and vehicle.
    """

    vehicles: Integers
    """The vehicle of each item of the term."""
    components: slice | Sequence[int]
    """Of the state."""
    values: Array
    """Shape (item, stage, row, component)."""


@dataclass(frozen=True, eq=False)
class ByInputs:
    """Derivatives of a residual by the inputs of one vehicle, at its own stage or at the one before."""

    vehicles: Integers
    """The vehicle of each item of the term."""
    values: Array
    """Shape (item, stage, row, N_INPUT)."""
    lag: int = 0
    """0: the inputs of the own stage; 1: those of the stage before, which the first stage does not have."""


@dataclass(frozen=True, eq=False)
class ByMeanThrusts:
    """Derivatives of a residual by the mean thrusts of one vehicle in its own stage.

    Without lag of the rotors these are its inputs; with lag they depend on all inputs up to this stage.
    """

    vehicles: Integers
    """The vehicle of each item of the term."""
    values: Array
    """Shape (item, stage, row, N_INPUT)."""


Derivatives = Sequence[ByStates | ByInputs | ByMeanThrusts]


class Term(Protocol):
    """One term of the cost of the team."""

    @property
    def name(self) -> str:
        """Name of the term; that of its weight in ``WeightsConfig``, if it has one there."""

    @property
    def n_items(self) -> int:
        """Number of pairs or vehicles that it sums over."""

    @property
    def n_rows(self) -> int:
        """Length of the residual of one item at one stage."""

    @property
    def at_end(self) -> bool:
        """Whether its stages are 1..N, at the end of each interval, or 0..N-1. No input changes stage 0."""

    @property
    def is_own(self) -> bool:
        """Whether there is one item per vehicle, which depends on that vehicle alone."""

    @property
    def is_constant(self) -> bool:
        """Whether its derivatives are by inputs only and the same everywhere."""

    @property
    def functions(self) -> Sequence[tuple[ca.Function, int]]:
        """CasADi functions to compile, with the number of items that each is mapped over."""

    def weights(self, weights: WeightsConfig) -> Array:
        """The weight of each residual, shape (item, stage, row) or one that broadcasts to it."""

    def derivatives(self, expansion: Expansion) -> Derivatives:
        """Derivatives around a guess, those by states first; all others are zero."""

    def residual(self, expansion: Expansion, instance: Instance) -> Array:
        """Residuals of an instance: exact in the geometry, to first order in the deviations.

        Returns:
            Shape (item, stage, row).
        """
