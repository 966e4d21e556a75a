"""In which order the vehicles of a team take off and land."""

import itertools
import math
from collections.abc import Mapping

from relform_core.flight_modes import Request
from relform_core.ground_config import column_spacing
from relform_core.scenario_config import ScenarioConfig
from relform_core.telemetry import TeamState

APPROACH_HEIGHT = 0.6
"""Height of the lowest vehicle at which a team has descended in formation, and each vehicle lands [m]."""
SETTLING_S = 5.0
"""How much longer than planned the take-off of a team may take [s]."""


class TakeOffPlan:
    """The vehicles take off one after the other, the highest place first: none climbs into another's wake."""

    def __init__(self, config: ScenarioConfig) -> None:
        assert config.ground is not None
        first = config.formations[config.phases[0].formation]
        up = {config.team.leader: 0.0} | {name: place[2] for name, place in first.items()}
        order = sorted(config.team.vehicles, key=lambda name: -up[name])
        self._starts = {name: turn * config.ground.interval for turn, name in enumerate(order)}
        """Time at which a vehicle leaves the ground [s]."""
        climb = (config.start.position[2] + max(up.values())) / config.ground.climb_speed
        self.time_max = max(self._starts.values()) + climb + SETTLING_S
        """Time after which all vehicles must hover [s]."""

    def requests(self, elapsed: float) -> dict[str, Request]:
        """What to ask of each vehicle at a time since the begin [s]."""
        return {
            name: Request.TAKE_OFF if elapsed >= start else Request.ARM
            for name, start in self._starts.items()
        }


class LandingPlan:
    """The vehicles land together, or one after the other, the lowest first.

    Args:
        heights: of the vehicles above any level, by name [m].
        interval: time between two vehicles [s]; 0: together.
    """

    def __init__(self, heights: Mapping[str, float], interval: float = 0.0) -> None:
        order = sorted(heights, key=heights.__getitem__)
        self._starts = {name: turn * interval for turn, name in enumerate(order)}
        """Time at which a vehicle begins to sink [s]."""

    def requests(self, elapsed: float) -> dict[str, Request]:
        """What to ask of each vehicle at a time since the begin [s]."""
        return {
            name: Request.LAND if elapsed >= start else Request.HOVER for name, start in self._starts.items()
        }


def heights(state: TeamState, leader: str) -> dict[str, float]:
    """Estimated heights of all vehicles above the leader, by name [m]."""
    above = {pair.target: float(pair.p_B1B2_C1__est[2]) for pair in state.pairs if pair.observer == leader}
    return {leader: 0.0, **above}


def landing_problem(config: ScenarioConfig, state: TeamState) -> str | None:
    """Why the team cannot land from where it is, in words; None: it can."""
    leader = config.team.leader
    places = {pair.target: pair.p_B1B2_C1__est for pair in state.pairs if pair.observer == leader}
    seen_from_above = {leader: (0.0, 0.0)} | {name: (x, y) for name, (x, y, _) in places.items()}
    needed = column_spacing(config.vehicle.separation_min)
    for (first, place), (second, other) in itertools.combinations(seen_from_above.items(), 2):
        if (apart := math.dist(place, other)) < needed:
            return (
                f"'{second}' is above or below '{first}': {apart:.2f} m apart seen from above, at least "
                f"{needed:.2f} m are needed; change the formation first"
            )
    return None
