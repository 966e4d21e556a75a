"""Vehicles take off, hover, fly, land and stop on request, on their own sensors and true legs."""

import math
import re
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_core.flight_modes import Request, VehicleMode
from relform_core.ground_config import DRIFT_MAX
from relform_core.measurements import Odometry, RotorCommand
from relform_core.scenario_config import ScenarioConfig
from relform_core.sensors.applied_rotor_speeds import APPLIED_ROTOR_SPEEDS
from relform_core.sensors.flight_status import FLIGHT_STATUS, FlightStatus
from relform_sim.vehicle import Vehicle
from support.scenarios import FROM_GROUND, paper_scenario

HUMMINGBIRD = (FROM_GROUND, "start.yaw_deg=40.0", "start.follower_yaw_max_deg=120.0")
CRAZYFLIE = (*HUMMINGBIRD, "vehicle=config/vehicles/crazyflie.yaml")
GUST = "events=[{}]".format(
    ", ".join(
        f"{{kind: wind, target: {name}, start_s: 7, end_s: 60, force_n: [0.25, 0.17, 0.0]}}"
        for name in ("leader", "follower_1", "follower_2")
    )
)
M = VehicleMode


@dataclass
class Flight:
    """What a team did, by step and vehicle; the first step is at rest on the ground."""

    config: ScenarioConfig
    truth: list[dict[str, Odometry]] = field(default_factory=list)
    status: list[dict[str, FlightStatus]] = field(default_factory=list)
    applied: dict[str, list[Any]] = field(default_factory=lambda: defaultdict(list))
    """Rotor speeds of the last intervals, as acknowledged, shape (interval, 4)."""
    faults: list[str] = field(default_factory=list)
    vehicles: dict[str, Vehicle] = field(default_factory=dict)

    def modes(self, name: str) -> list[VehicleMode]:
        """One after the other, without repetition."""
        modes = [status[name].mode for status in self.status]
        return [mode for before, mode in zip([None, *modes], modes, strict=False) if mode is not before]

    def during(self, name: str, mode: VehicleMode) -> list[Odometry]:
        return [
            truth[name]
            for truth, status in zip(self.truth, self.status, strict=True)
            if status[name].mode is mode
        ]


Script = Callable[[float, str], Request | RotorCommand | None]
"""Time of the command [s] and vehicle to what is sent to it; None: nothing."""


def command(config: ScenarioConfig, step: int, request: Request) -> RotorCommand:
    return RotorCommand(step * config.period_ns, config.period_ns, np.zeros(4), np.zeros((0, 4)), request)


def fly(overrides: tuple[str, ...], seed: int, duration: float, script: Script) -> Flight:
    """Fly until the end or the first fault."""
    config = paper_scenario(*overrides).config
    flight = Flight(config, vehicles={name: Vehicle(config, seed, name) for name in config.team.vehicles})
    for step in range(round(duration / config.controller.period) + 1):
        truth = {}
        for name, vehicle in flight.vehicles.items():
            asked = script((step - 1) * config.controller.period, name) if step > 0 else None
            sent = command(config, step - 1, asked) if isinstance(asked, Request) else asked
            truth[name] = vehicle.advance(step, sent)
        flight.truth.append(truth)
        flight.status.append({})
        for name, vehicle in flight.vehicles.items():
            measured = vehicle.measure(step, truth)
            status, applied = measured.newest(FLIGHT_STATUS), measured.newest(APPLIED_ROTOR_SPEEDS)
            assert status is not None
            flight.applied[name].append(None if applied is None else applied.speeds[-10:])
            flight.status[-1][name] = status
            if (fault := vehicle.fault(step, truth)) is not None:
                flight.faults.append(fault)
        if flight.faults:
            break
    return flight


def up_and_down(time: float, name: str) -> Request:
    if time < 1.0:
        return Request.REST if time < 0.5 else Request.ARM
    return Request.TAKE_OFF if time < 9.0 else Request.LAND


def up_for_6_seconds(time: float, name: str) -> Request:
    return Request.TAKE_OFF if time < 6.0 else Request.LAND


def climb(state: Odometry) -> float:
    return float(Rotation.from_quat(state.q_NB).apply(state.v_NB_B)[2])


def tilt(state: Odometry) -> float:
    return math.acos(min(1.0, Rotation.from_quat(state.q_NB).as_matrix()[2, 2]))


@pytest.mark.parametrize("overrides", [HUMMINGBIRD, CRAZYFLIE], ids=["hummingbird", "crazyflie"])
def test_up_and_down(overrides: tuple[str, ...]) -> None:
    flight = fly(overrides, 1, 16.0, up_and_down)
    rest = flight.config.vehicle.leg_height
    assert flight.faults == []
    for name, place in flight.config.start_places.items():
        assert flight.modes(name) == [M.IDLE, M.ARMED, M.TAKING_OFF, M.HOVERING, M.LANDING, M.IDLE]
        start, end = flight.truth[0][name], flight.truth[-1][name]
        assert start.p_NB_N == pytest.approx([place[0], place[1], rest])
        on_the_ground = [*flight.during(name, M.ARMED), *flight.during(name, M.IDLE)[:10]]
        assert max(np.linalg.norm(state.p_NB_N - start.p_NB_N) for state in on_the_ground) < 5e-4
        hover = flight.during(name, M.HOVERING)[60:]
        assert max(abs(state.p_NB_N[2] - place[2]) for state in hover) < 0.1
        assert max(climb(state) for state in flight.during(name, M.TAKING_OFF)) < 1.1
        assert end.p_NB_N[2] == pytest.approx(rest, abs=1e-4)
        assert np.linalg.norm(end.v_NB_B) < 1e-3
        assert tilt(end) < 1e-3
        turned = Rotation.from_quat(start.q_NB).inv() * Rotation.from_quat(end.q_NB)
        assert turned.magnitude() < math.radians(10.0)  # the yaw is held by the IMU, which drifts


def test_hovers_of_20_seconds_stay_in_place() -> None:
    """95% of 6 leaders and 12 followers; flow and accelerometer alone would allow 0.5 m."""
    drifts: dict[bool, list[float]] = {True: [], False: []}
    for seed in range(6):
        flight = fly(HUMMINGBIRD, seed, 21.0, lambda time, name: Request.TAKE_OFF)
        assert flight.faults == []
        for name, place in flight.config.start_places.items():
            is_leader = name == flight.config.team.leader
            drifts[is_leader].append(math.dist(flight.truth[-1][name].p_NB_N[:2], place[:2]))
    assert np.percentile(drifts[True], 95) < DRIFT_MAX
    assert np.percentile(drifts[False], 95) < 1.5 * DRIFT_MAX


@pytest.mark.parametrize(
    "overrides",
    [pytest.param((*HUMMINGBIRD, GUST), id="hummingbird in a gust"), pytest.param(CRAZYFLIE, id="crazyflie")],
)
def test_landings_are_soft_and_upright(overrides: tuple[str, ...]) -> None:
    """A gust of 0.3 N begins as the vehicles sink."""
    for seed in range(7):
        flight = fly(overrides, seed, 13.0, up_for_6_seconds)
        rest = flight.config.vehicle.leg_height
        assert flight.faults == []
        for name in flight.vehicles:
            assert flight.modes(name)[-2:] == [M.LANDING, M.IDLE]
            landing = flight.during(name, M.LANDING)
            touch = next(k for k, state in enumerate(landing) if state.p_NB_N[2] < rest + 0.005)
            assert -climb(landing[touch - 1]) < 0.35
            assert max(state.p_NB_N[2] for state in landing[touch:]) < rest + 0.03
            assert max(map(tilt, landing)) < math.radians(8.0)
            assert len(landing) - touch < 1.5 / flight.config.controller.period  # then the motors are cut
            assert math.dist(landing[0].p_NB_N[:2], landing[-1].p_NB_N[:2]) < 0.4
            assert tilt(flight.truth[-1][name]) < 1e-3


def test_between_hovers_it_flies_what_it_is_sent() -> None:
    """Half a second of the controller: up and with a turn, by rotor speeds that are acknowledged."""
    speeds = paper_scenario(*HUMMINGBIRD).config.vehicle.hover_speed + np.array([40.0, 2.0, 40.0, 2.0])

    def script(time: float, name: str) -> Request | RotorCommand:
        if 6.0 <= time < 6.5 and name == "follower_1":
            step = round(time / 0.05)
            return RotorCommand(step * 50_000_000, 50_000_000, speeds, np.zeros((0, 4)))
        return Request.TAKE_OFF if time < 6.0 else Request.HOVER if time < 10.0 else Request.LAND

    flight = fly(HUMMINGBIRD, 3, 17.0, script)
    assert flight.faults == []
    in_the_air = [M.TAKING_OFF, M.HOVERING, M.FLYING, M.HOVERING, M.LANDING]
    assert flight.modes("follower_1") == [M.IDLE, M.ARMED, *in_the_air, M.IDLE]
    flown = flight.during("follower_1", M.FLYING)
    assert len(flown) == 10
    assert climb(flown[-1]) > 0.15
    assert flown[-1].w_NB_B[2] > 0.25
    last = max(k for k, status in enumerate(flight.status) if status["follower_1"].mode is M.FLYING)
    np.testing.assert_array_equal(flight.applied["follower_1"][last], np.broadcast_to(speeds, (10, 4)))
    after = flight.during("follower_1", M.HOVERING)
    assert np.linalg.norm(after[-1].v_NB_B) < 0.2
    assert after[-1].p_NB_N[2] > flown[0].p_NB_N[2] + 0.05  # it stays where it stopped


def test_a_vehicle_that_hears_nothing_lands_for_good() -> None:
    """The link of one ends in its climb, that of another in a hover, and that of the leader in a landing."""
    ends = {"leader": 6.5, "follower_1": 0.8, "follower_2": 5.5}

    def script(time: float, name: str) -> Request | None:
        if time >= ends[name]:
            return None
        return Request.TAKE_OFF if time < 6.0 else Request.LAND

    flight = fly(HUMMINGBIRD, 2, 15.0, script)
    assert flight.faults == []
    climbing, hovering = [M.IDLE, M.ARMED, M.TAKING_OFF], [M.IDLE, M.ARMED, M.TAKING_OFF, M.HOVERING]
    assert flight.modes("leader") == [*hovering, M.LANDING, M.IDLE]
    assert flight.modes("follower_1") == [*climbing, M.FAILSAFE, M.STOPPED]
    assert flight.modes("follower_2") == [*hovering, M.FAILSAFE, M.STOPPED]
    assert flight.status[-1]["follower_1"].reason == "it is on the ground"
    counts = flight.vehicles["follower_1"].counts
    assert counts.failsafe == len(flight.during("follower_1", M.FAILSAFE))
    assert counts.disarmed == len(flight.during("follower_1", M.STOPPED))


def test_a_stop_in_the_air_is_a_fall() -> None:
    flight = fly(HUMMINGBIRD, 1, 8.0, lambda time, name: Request.TAKE_OFF if time < 6.0 else Request.STOP)
    assert flight.modes("leader")[-2:] == [M.HOVERING, M.STOPPED]
    assert len(flight.faults) == 2  # the followers are lower
    hit = r"follower_1 hit the ground at 4\.\d m/s \(at most 1 m/s are allowed\)"
    assert re.fullmatch(hit, flight.faults[0])


def test_a_stop_on_the_ground_is_for_good() -> None:
    flight = fly(HUMMINGBIRD, 1, 3.0, lambda time, name: Request.STOP if time < 0.5 else Request.TAKE_OFF)
    assert flight.modes("leader") == [M.IDLE, M.STOPPED]
    assert flight.status[-1]["leader"].reason == "refuses to take off while stopped"
    assert flight.vehicles["leader"].counts.refused == 50


def test_a_flight_into_the_ground_is_a_crash() -> None:
    slow = np.full(4, 300.0)

    def script(time: float, name: str) -> Request | RotorCommand:
        if time < 6.0 or name != "follower_2":
            return Request.TAKE_OFF
        return RotorCommand(round(time / 0.05) * 50_000_000, 50_000_000, slow, np.zeros((0, 4)))

    flight = fly(HUMMINGBIRD, 1, 9.0, script)
    assert flight.faults == ["follower_2 touched the ground while flying"]


def test_a_team_that_hears_nothing_on_the_ground_stays_there() -> None:
    def arm_the_leader(time: float, name: str) -> Request | None:
        return Request.ARM if time < 0.3 and name == "leader" else None

    flight = fly(HUMMINGBIRD, 1, 3.0, arm_the_leader)
    assert flight.modes("leader") == [M.IDLE, M.ARMED]
    assert flight.modes("follower_1") == [M.IDLE]
    assert flight.faults == []


def test_a_hover_that_is_asked_for_on_the_ground_is_flown_above_it() -> None:
    """A climb that has just begun is no reason to hover in contact with the ground."""
    flight = fly(HUMMINGBIRD, 1, 6.0, lambda time, name: Request.TAKE_OFF if time < 0.2 else Request.HOVER)
    assert flight.faults == []
    assert flight.modes("leader") == [M.IDLE, M.ARMED, M.TAKING_OFF, M.HOVERING]
    assert flight.truth[-1]["leader"].p_NB_N[2] == pytest.approx(0.5, abs=0.05)
