"""Streams of SQP steps as a flight takes them: what the solver was given, step by step."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from relform_analysis.flight.simulate import simulate
from relform_controller.blas import one_blas_thread
from relform_controller.formation_controller import FormationController
from relform_controller.ocp.problem import HorizonReference, HorizonStart, Ocp, Plan, TeamGeometry
from relform_controller.solver.make import make_solver
from relform_controller.solver.solver import Solver, SqpStep
from relform_core.config_files import find_config
from relform_core.controller_config import WeightsConfig
from relform_core.load import LoadedScenario, load_scenario
from relform_core.units import seconds_to_ns

SCENARIOS = {3: "paper", 5: "five", 8: "eight"}
"""Scenarios by the number of their vehicles; other teams fly the paper's phases in a wedge."""


@dataclass(frozen=True, eq=False)
class Instance:
    """One SQP step: what was given to ``prepare`` and to ``feedback``."""

    guess: Plan
    geometry_predicted: TeamGeometry
    start: HorizonStart
    geometry: TeamGeometry
    reference: HorizonReference
    active_bounds: int
    """Of the step that the flight took."""
    is_constrained: bool = False
    """Whether a soft constraint was active in it."""


@dataclass(frozen=True, eq=False)
class Stream:
    """SQP steps of a flight, in their order."""

    ocp: Ocp
    instances: list[Instance]


class RecordingSolver:
    """A ``Solver`` that keeps every SQP step of another one."""

    def __init__(self, solver: Solver, instances: list[Instance]) -> None:
        self._solver = solver
        self._instances = instances
        self._given: tuple[Plan, TeamGeometry] | None = None

    def set_weights(self, weights: WeightsConfig) -> None:
        """See ``Solver``."""
        self._solver.set_weights(weights)

    def prepare(self, guess: Plan, geometry: TeamGeometry) -> None:
        """See ``Solver``."""
        self._given = guess, geometry
        self._solver.prepare(guess, geometry)

    def feedback(self, start: HorizonStart, geometry: TeamGeometry, reference: HorizonReference) -> SqpStep:
        """See ``Solver``."""
        step = self._solver.feedback(start, geometry, reference)
        assert self._given is not None
        is_constrained = bool(step.active_constraints)
        self._instances.append(
            Instance(*self._given, start, geometry, reference, step.active_bounds, is_constrained)
        )
        return step


def record(
    scenario: LoadedScenario,
    n_instances: int,
    begin: float = 0.0,
    make: Callable[[Ocp], Solver] = make_solver,
) -> Stream:
    """SQP steps in a row of one flight; fewer if the flight ends before.

    Args:
        scenario: to fly.
        n_instances: how many SQP steps.
        begin: time of the first one [s]; at 0 the flight iterates to convergence.
        make: makes the solver that the flight uses.
    """
    instances: list[Instance] = []
    problems: list[Ocp] = []

    def recording(ocp: Ocp) -> Solver:
        problems.append(ocp)
        return RecordingSolver(make(ocp), instances)

    controller = FormationController(scenario.config, solver=recording)
    n_before = 0
    with one_blas_thread():
        for step in simulate(scenario, controller):
            if step.measurements.arrival_ns < seconds_to_ns(begin):
                n_before = len(instances)
            if len(instances) >= n_before + n_instances:
                break
    return Stream(problems[0], instances[n_before : n_before + n_instances])


def scenario_of(
    n_vehicles: int, controller: str, overrides: Sequence[str] = (), seed: int = 1
) -> LoadedScenario:
    """The phases of the paper, flown by a team of this size.

    Args:
        n_vehicles: at least 2.
        controller: plain name of its tuning, for instance ``paper`` or ``team``.
        overrides: texts ``some.key=value``.
        seed: of the flight.
    """
    team = [] if n_vehicles in SCENARIOS else wedge(n_vehicles)
    changes = [f"controller={find_config('controller', controller)}", *team, *overrides]
    return load_scenario(SCENARIOS.get(n_vehicles, "paper"), changes, seed)


def wedge(n_vehicles: int) -> list[str]:
    """Overrides of a scenario: this many vehicles, the followers in rows of two, three, two ... behind."""
    followers = [f"follower_{number}" for number in range(1, n_vehicles)]
    places: list[tuple[float, float, float]] = []
    row = 0
    while len(places) < len(followers):
        row += 1
        width = 2 if row % 2 else 3
        places += [(-0.9 * row, column - 0.5 * (width - 1), -0.5 * row) for column in range(width)]

    def formation(stretch: float) -> str:
        items = [
            f"{name}: [{x:.3f}, {stretch * y:.3f}, {z:.3f}]"
            for name, (x, y, z) in zip(followers, places, strict=False)
        ]
        return f"{{{', '.join(items)}}}"

    return [
        f"team.followers=[{', '.join(followers)}]",
        f"formations_m={{initial: {formation(1.0)}, wide: {formation(1.5)}}}",
        "start.position_m=[0.0, 0.0, 6.0]",
        "phases.3.formation_step=false",
    ]
