"""The flight director: takes a team from the ground into formation and back, and decides on requests.

The states of a team, and the requests that it takes in each, are in ``relform_core.flight_modes``. On the
ground, and while the vehicles take off and land on their own sensors, it only sends them requests. Once all
of them hover, a ``FormationController`` flies the team until it is to land.
"""

import math
import time
from collections.abc import Callable, Mapping

import numpy as np

from relform_controller.estimation.registry import make_estimator
from relform_controller.formation_controller import FormationController
from relform_controller.ground_plan import (
    APPROACH_HEIGHT,
    LandingPlan,
    TakeOffPlan,
    heights,
    landing_problem,
)
from relform_controller.ocp.problem import Ocp
from relform_controller.reference.fence import check_scenario
from relform_controller.reference.online_mission import OnlineMission, phases_trajectory
from relform_controller.reference.timed_path import rows_of
from relform_controller.solver.make import make_solver
from relform_controller.solver.solver import Solver
from relform_controller.take_over import GAP_MAX_S, take_over_problem
from relform_core.blend import Blend
from relform_core.controller_config import WeightsConfig
from relform_core.errors import ConfigError, FlightError
from relform_core.flight_modes import ON_THE_GROUND, Request, TeamMode, TeamRequest, VehicleMode, refusal
from relform_core.measurements import RotorCommand, TeamMeasurements
from relform_core.scenario_config import ScenarioConfig
from relform_core.schema import Vector3
from relform_core.sensors.flight_status import FLIGHT_STATUS, FlightStatus
from relform_core.telemetry import Decision, RequestMade, Standby, TeamStatus
from relform_core.units import NANOSECONDS_PER_SECOND, seconds_to_ns

SILENCE_MAX_S = 1.0
"""How long nothing may be heard from a vehicle in the air [s]; then the team lands."""
TAKE_OVER_MAX_S = 2.0
"""Within this time all vehicles must hover for a controller that takes over [s]."""
_WATCHED = frozenset(
    {TeamMode.TAKING_OFF, TeamMode.TAKING_OVER, TeamMode.HOVERING, TeamMode.FLYING, TeamMode.LANDING}
)
_LOST = frozenset({VehicleMode.FAILSAFE, VehicleMode.STOPPED})
_UP = frozenset({VehicleMode.HOVERING, VehicleMode.FLYING})
_FENCED = frozenset({TeamMode.TAKING_OFF, TeamMode.HOVERING, TeamMode.FLYING})


class FlightDirector:
    """Flies a team from take-off to landing.

    Without ``ground.waits`` it makes the requests itself: take off, fly the phases, land.

    Args:
        config: a scenario with ``ground``.
        clock: monotonic time [s], for the solver's reports.
        time_budget: see ``FormationController``.
        solver: likewise.
    """

    def __init__(
        self,
        config: ScenarioConfig,
        clock: Callable[[], float] = time.perf_counter,
        time_budget: float = math.inf,
        solver: Callable[[Ocp], Solver] = make_solver,
    ) -> None:
        if config.ground is None:
            raise ValueError(f"scenario '{config.name}' has no section 'ground'")
        self._config = config
        self._ground = config.ground
        self._clock = clock
        self._time_budget = time_budget
        self._make_solver = solver
        self.mode = TeamMode.IDLE
        self.reason = ""
        """Why the mode is what it is, unless somebody asked for it."""
        self.refused = ""
        """Why the newest request was refused, for the status; empty: it was not."""
        self._now_ns = self._began_ns = self._landing_ns = 0
        """The present step, and those in which the mode and the landing of the vehicles began."""
        self._status: dict[str, FlightStatus] = {}
        """The newest of each vehicle."""
        self._weights: WeightsConfig | None = None
        self._take_off = TakeOffPlan(config)
        self._landing: LandingPlan | None = None
        """None: the team flies in formation, also while it descends to land."""
        self._decision: Decision | None = None
        """Of the newest step; None: it had none."""
        self._resumes = False
        """Whether the first step is that of a controller which takes over."""
        self._has_to_rise = False
        """Whether the vehicles may be so low that their places in formation are in the ground."""
        self._script = [TeamRequest.TAKE_OFF, TeamRequest.START, TeamRequest.LAND]
        """What remains to be requested by the director itself."""
        if config.ground.waits:
            self._script.clear()
        else:
            check_scenario(config)
        self._breach = ""
        """Where vehicles left the geofence, until something else is asked for."""
        self._trajectory = phases_trajectory(config)
        """For all flights."""
        self._prepare_flight()

    @property
    def formation(self) -> Mapping[str, Vector3]:
        """See ``FormationController``."""
        return self._mission.formation

    @property
    def status(self) -> TeamStatus:
        """What the team does."""
        return TeamStatus(self.mode, self.reason, self.refused, self.vehicle_modes)

    @property
    def vehicle_modes(self) -> Mapping[str, VehicleMode]:
        """What the vehicles last reported to do, in team order; those that never did are missing."""
        return {name: self._status[name].mode for name in self._config.team.vehicles if name in self._status}

    def resume(self) -> None:
        """Take over a team of which nothing is known, see ``FormationController``.

        Vehicles in the air hover, form up, and then land if the scenario does not wait for requests: what it
        has flown is not known any more. A team on the ground stays there.
        """
        is_to_land = self.mode is TeamMode.LANDING or not self._ground.waits
        self._script = [TeamRequest.LAND] if is_to_land else []
        self._enter(TeamMode.TAKING_OVER)
        self._resumes = True
        self._prepare_flight(is_at_rest=False)

    def set_weights(self, weights: WeightsConfig) -> None:
        """See ``FormationController``."""
        self._weights = weights
        self._controller.set_weights(weights)

    def way_to(self, formation: Mapping[str, Vector3]) -> Blend:
        """See ``FormationController``."""
        return self._mission.way_to(formation)

    def check_formation(self, formation: Mapping[str, Vector3]) -> None:
        """See ``FormationController``."""
        if formation == self.formation:
            return
        if problem := refusal(TeamRequest.SET_FORMATION, self.mode):
            raise ConfigError(problem)
        self._mission.check_formation(formation)

    def set_formation(self, formation: Mapping[str, Vector3]) -> None:
        """See ``FormationController``."""
        self.check_formation(formation)
        self._mission.set_formation(formation)

    def request(self, made: RequestMade) -> None:
        """Do something else from the next step on.

        Raises:
            ConfigError: the team refuses; the message gives the reason.
        """
        if problem := refusal(made.request, self.mode):
            raise ConfigError(problem)
        self._breach = ""
        match made.request:
            case TeamRequest.TAKE_OFF:
                self._enter(TeamMode.TAKING_OFF)
            case TeamRequest.START:
                self._mission.start()
            case TeamRequest.HOVER:
                self._mission.hover()
            case TeamRequest.GO_TO:
                x, y, z, yaw = made.values
                self._mission.go_to(np.array([x, y, z]), yaw)
            case TeamRequest.FOLLOW_TRAJECTORY:
                self._mission.follow_trajectory(rows_of(made.values))
            case TeamRequest.LAND:
                self._land()
            case TeamRequest.EMERGENCY_LAND:
                self._land_at_once(TeamMode.LANDING)
            case TeamRequest.EMERGENCY_STOP:
                self._enter(TeamMode.STOPPED, "emergency stop")

    def step(self, measurements: TeamMeasurements, sqp_steps: int | None = None) -> Decision | Standby:
        """See ``FormationController``."""
        outcome = self.feedback(measurements, sqp_steps)
        self.prepare_next()
        return outcome

    def feedback(self, measurements: TeamMeasurements, sqp_steps: int | None = None) -> Decision | Standby:
        """See ``FormationController``."""
        is_gap = measurements.arrival_ns - self._now_ns > seconds_to_ns(GAP_MAX_S)
        self._now_ns = measurements.arrival_ns
        if is_gap and self.mode in _WATCHED and self._landing is None and not self._resumes:
            self.resume()
        if self._resumes:
            self._began_ns, self._resumes = self._now_ns, False
        for name in self._config.team.vehicles:
            if (status := measurements.by_vehicle[name].newest(FLIGHT_STATUS)) is not None:
                self._status[name] = status
        self._follow_script()
        if self.mode in _WATCHED and (problem := self._problem()):
            self._land_at_once(TeamMode.FAILSAFE, problem)
        try:
            outcome = self._outcome(measurements, sqp_steps)
        except FlightError as error:  # the controller cannot start
            self._land_at_once(TeamMode.FAILSAFE, str(error))
            outcome = self._land_vehicles()
        self._decision = outcome if isinstance(outcome, Decision) else None
        if self._decision is not None and self._decision.breach and self.mode in _FENCED:
            self._answer_breach(self._decision.breach)
        return outcome

    def prepare_next(self) -> None:
        """See ``FormationController``."""
        if self._decision is not None:
            self._controller.prepare_next()

    def _outcome(self, measurements: TeamMeasurements, sqp_steps: int | None) -> Decision | Standby:
        match self.mode:
            case TeamMode.IDLE:
                return self._standby(self._all(Request.REST), "take_off: the team is on the ground")
            case TeamMode.STOPPED:
                return self._standby(self._all(Request.STOP), f"nothing: the team is stopped, {self.reason}")
            case TeamMode.TAKING_OFF if not self._is_up:
                requests = self._take_off.requests(self._since(self._began_ns))
                return self._standby(requests, "the vehicles to take off")
            case TeamMode.TAKING_OVER if not self._is_up:
                return self._take_over(measurements)
        return self._fly(measurements, sqp_steps) if self._landing is None else self._land_vehicles()

    def _fly(self, measurements: TeamMeasurements, sqp_steps: int | None) -> Decision | Standby:
        outcome = self._controller.feedback(measurements, sqp_steps)
        if isinstance(outcome, Standby):  # the vehicles hover while the estimator starts
            return self._standby(self._all(Request.HOVER), outcome.reason)
        if not outcome.commands:
            self._land_at_once(TeamMode.FAILSAFE, f"no plan is left: {outcome.solver.fallback_reason}")
            return self._land_vehicles()
        if self.mode is TeamMode.TAKING_OVER and not outcome.holds_for and self._has_to_rise:
            self._mission.rise(APPROACH_HEIGHT)
            self._has_to_rise = False
        is_resting = self._mission.is_resting and not outcome.holds_for
        if self.mode is TeamMode.LANDING and is_resting:
            above = heights(outcome.state, self._config.team.leader)
            self._begin_landing(above, self._ground.interval if self._ground.landing == "one_by_one" else 0.0)
        elif is_resting and self.mode is not TeamMode.HOVERING:
            self._enter(TeamMode.HOVERING, self._breach)
        elif not is_resting and self.mode is TeamMode.HOVERING:
            self._enter(TeamMode.FLYING, self._breach)
        return outcome

    def _answer_breach(self, breach: str) -> None:
        """Land, or say why the mission brakes."""
        assert self._config.geofence is not None
        if self._config.geofence.reaction == "land":
            self._land_at_once(TeamMode.LANDING, breach)
        else:
            self._breach = self.reason = breach

    def _take_over(self, measurements: TeamMeasurements) -> Standby:
        """Until all vehicles hover: ask them to, which changes nothing on the ground."""
        vehicles, modes = self._config.team.vehicles, self.vehicle_modes
        found = [take_over_problem(name, measurements.by_vehicle[name]) for name in vehicles]
        problems = [problem for problem in found if problem]
        if len(modes) == len(vehicles) and ON_THE_GROUND.issuperset(modes.values()):
            self._stay_on_ground()
        elif len(modes) == len(vehicles) and problems:
            self._land_at_once(TeamMode.FAILSAFE, f"not taken over: {problems[0]}")
            return self._land_vehicles()
        return self._standby(self._all(Request.HOVER), "the vehicles to hover")

    def _begin_landing(self, above: Mapping[str, float], interval: float) -> None:
        """From the next step on each vehicle lands on its own sensors."""
        self._landing = LandingPlan(above, interval)
        self._landing_ns = self._now_ns

    def _land_vehicles(self) -> Standby:
        assert self._landing is not None
        requests = self._landing.requests(self._since(self._landing_ns))
        if all(map(self._has_landed, self._status.values())):
            self._landing = None
            self._stay_on_ground()
        return self._standby(requests, "the vehicles to land")

    def _stay_on_ground(self) -> None:
        """All vehicles are on the ground: wait for the next flight, unless one of them is stopped."""
        stopped = [name for name, mode in self.vehicle_modes.items() if mode is VehicleMode.STOPPED]
        if stopped:
            self._enter(TeamMode.STOPPED, f"{stopped[0]} is stopped: {self._status[stopped[0]].reason}")
        else:
            self._enter(TeamMode.IDLE, self.reason)
            self._prepare_flight()

    def _has_landed(self, status: FlightStatus) -> bool:
        """Whether a vehicle that was asked to land says that it is on the ground; before, it may rise."""
        asked_ns = self._landing_ns + self._config.command_lead_ns + self._config.period_ns
        is_answer = status.stamp_ns > asked_ns or status.mode is VehicleMode.STOPPED
        return is_answer and status.mode in ON_THE_GROUND

    def _since(self, begin_ns: int) -> float:
        """Time from an instant to the present step [s]."""
        return (self._now_ns - begin_ns) / NANOSECONDS_PER_SECOND

    @property
    def _is_up(self) -> bool:
        """Whether all vehicles wait for the controller, or fly by it."""
        modes = self.vehicle_modes.values()
        return len(self._status) == len(self._config.team.vehicles) and _UP.issuperset(modes)

    def _problem(self) -> str | None:
        """Why the team must land, in words; None: it can fly on."""
        is_taking_over = self.mode is TeamMode.TAKING_OVER and not self._is_up
        for name, status in self._status.items():
            if status.mode in _LOST and not is_taking_over:
                return f"{name} is in {status.mode}: {status.reason}"
            if self._now_ns - status.stamp_ns > seconds_to_ns(SILENCE_MAX_S):
                return f"nothing was heard from {name} for {SILENCE_MAX_S:g} s"
        is_late = self._since(self._began_ns) > self._take_off.time_max
        if self.mode is TeamMode.TAKING_OFF and not self._is_up and is_late:
            absent = [name for name in self._config.team.vehicles if self.vehicle_modes.get(name) not in _UP]
            return f"{absent[0]} has not taken off within {self._take_off.time_max:.1f} s"
        if is_taking_over and self._since(self._began_ns) > TAKE_OVER_MAX_S:
            return f"the vehicles do not hover within {TAKE_OVER_MAX_S:g} s"
        return None

    def _follow_script(self) -> None:
        """Without requests from outside: make the next one as soon as it is allowed."""
        is_settled = self.mode is not TeamMode.FLYING and self._now_ns > self._began_ns
        if self._script and is_settled and refusal(self._script[0], self.mode) is None:
            request = self._script.pop(0)
            try:
                self.request(RequestMade(request))
            except ConfigError as error:
                if request is not TeamRequest.START:
                    raise
                self.refused = str(error)  # the team lands instead

    def _land(self) -> None:
        decision = self._decision
        if decision is None:
            raise ConfigError("land is refused: the controller does not fly the team yet")
        if problem := landing_problem(self._config, decision.state):
            raise ConfigError(f"land is refused: {problem}")
        self._mission.descend(APPROACH_HEIGHT)
        self._enter(TeamMode.LANDING)

    def _land_at_once(self, mode: TeamMode, reason: str = "") -> None:
        self._begin_landing(dict.fromkeys(self._config.team.vehicles, 0.0), interval=0.0)
        self._enter(mode, reason)

    def _enter(self, mode: TeamMode, reason: str = "") -> None:
        self.mode, self.reason, self._began_ns = mode, reason, self._now_ns

    def _prepare_flight(self, *, is_at_rest: bool = True) -> None:
        """A new controller and mission, for the next flight; or for vehicles that move already."""
        self._mission = OnlineMission(self._config, self._trajectory)
        self._has_to_rise = not is_at_rest
        self._controller: FormationController = FormationController(
            self._config,
            self._clock,
            self._mission,
            make_estimator(self._config, is_at_rest=is_at_rest),
            solver=self._make_solver,
            time_budget=self._time_budget,
        )
        if self._weights is not None:
            self._controller.set_weights(self._weights)

    def _all(self, request: Request) -> dict[str, Request]:
        return dict.fromkeys(self._config.team.vehicles, request)

    def _standby(self, requests: Mapping[str, Request], reason: str) -> Standby:
        start_ns, period_ns = self._now_ns + self._config.command_lead_ns, self._config.period_ns
        return Standby(
            reason,
            {
                name: RotorCommand(start_ns, period_ns, np.zeros(4), np.zeros((0, 4)), requests[name])
                for name in self._config.team.vehicles
            },
        )
