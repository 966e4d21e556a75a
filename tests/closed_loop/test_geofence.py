"""A team that a gust drives out of its geofence returns and stays, or lands; vehicles keep below its top."""

import numpy as np
import pytest

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.simulate import fly_in_process, simulate
from relform_controller.flight_director import FlightDirector
from relform_core.errors import ConfigError
from relform_core.load import load_scenario

FENCE = "geofence={x_m: [-3.0, 19.0], y_m: [-1.0, 1.0], height_max_m: 3.0}"
AIRBORNE_GUST = "events=[{kind: wind, target: leader, start_s: 3.0, end_s: 4.0, force_n: [0.0, 6.0, 2.0]}]"
GROUND = (
    "ground={time_s: 30.0, climb_speed_m_s: 1.0, descent_speed_m_s: 1.0, interval_s: 0.5}",
    "events=[{kind: wind, target: leader, start_s: 8.0, end_s: 9.0, force_n: [0.0, 6.0, 2.0]}]",
)


def fly(seed: int, *overrides: str) -> FlightLog:
    return fly_in_process(load_scenario("gust", overrides, seed))


def largest(log: FlightLog) -> np.ndarray:
    """By coordinate, over the last second."""
    return np.abs(log.p_NB_N[-20:]).max(axis=(0, 1))


@pytest.mark.parametrize("seed", [0, 1])
def test_a_team_in_the_air_returns_and_stays(seed: int) -> None:
    longer = "phases.0.duration_s=10.0"
    free, fenced = fly(seed, longer, AIRBORNE_GUST), fly(seed, longer, FENCE, AIRBORNE_GUST)
    assert free.alarms == ()
    assert np.abs(free.p_NB_N[:, :, 1]).max() > 1.2
    assert (free.faults, fenced.faults) == ((), ())
    assert "outside the geofence: y = 1.0" in fenced.alarms[0].description
    assert largest(fenced)[1] < 0.85  # formation 0.5 m to each side
    # The free one flies on, the other one brakes as soon as it is noticed.
    assert free.p_NB_N[-1, 0, 0] > 18.0
    assert fenced.p_NB_N[-1, 0, 0] < 8.0
    assert np.linalg.norm(fenced.v_NB_B[-10:], axis=2).max() < 0.2


@pytest.mark.parametrize("reaction", ["hold", "land"])
def test_a_team_from_the_ground_says_why_it_holds_or_lands(reaction: str) -> None:
    log = fly(1, FENCE, f"geofence.reaction={reaction}", *GROUND)
    assert log.faults == ()
    assert log.p_NB_N[-1, :, 2].max() < 0.11
    said = [entry.description for entry in log.changes]
    # On its own after a hold it lands in the way that it would at the end of its phases.
    first = {"hold": "hovering: ", "land": "landing: "}[reaction]
    assert any(each.startswith(first) and "outside the geofence: " in each for each in said), said
    assert said[-1].startswith("idle")


def test_a_vehicle_that_climbs_out_comes_down_by_itself() -> None:
    """Its controller believes a localization that is 2 m too low, and climbs; the sonar is right."""
    overrides = (
        "controller=retuned",
        "geofence={x_m: [-9, 20], y_m: [-9, 9], height_max_m: 2.6}",
        "events=[{kind: localization_jump, target: leader, start_s: 2, end_s: 7, offset_m: [0, 0, -2]}]",
    )
    heights = {}
    for name, changed in (("fenced", overrides), ("free", (overrides[0], overrides[2]))):
        log = fly(3, *changed)
        assert log.faults == ()
        heights[name] = log.p_NB_N[:, :, 2].max()
    assert heights["free"] > 3.2
    assert heights["fenced"] < 2.9


def test_a_flight_that_would_leave_is_refused_before_it_starts() -> None:
    small = (FENCE, "geofence.x_m=[-3.0, 9.0]")
    says = r"'leader' would leave the geofence: x = 12\.50 m, at most 8\.70 m \(geofence\.x_m\)"
    with pytest.raises(ConfigError, match=says):
        next(simulate(load_scenario("gust", small)))
    with pytest.raises(ConfigError, match=says):
        FlightDirector(load_scenario("gust", [*small, "ground={}"]).config)
