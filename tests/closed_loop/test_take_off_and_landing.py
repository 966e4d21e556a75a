"""Vehicles take off, hover, fly, land and stop on request, on their own sensors and true legs."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_core.flight_modes import Request, VehicleMode
from relform_core.measurements import Odometry, RotorCommand
from relform_core.scenario_config import ScenarioConfig
from relform_core.sensors.flight_status import FLIGHT_STATUS, FlightStatus
from relform_sim.vehicle import Vehicle
from support.scenarios import FROM_GROUND, paper_scenario

HUMMINGBIRD = (FROM_GROUND, "start.yaw_deg=40.0", "start.follower_yaw_max_deg=120.0")
CRAZYFLIE = (*HUMMINGBIRD, "vehicle=config/vehicles/crazyflie.yaml")
M = VehicleMode


@dataclass
class Flight:
    """What a team did, by step and vehicle; the first step is at rest on the ground."""

    config: ScenarioConfig
    truth: list[dict[str, Odometry]] = field(default_factory=list)
    status: list[dict[str, FlightStatus]] = field(default_factory=list)
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
            status = vehicle.measure(step, truth).newest(FLIGHT_STATUS)
            assert status is not None
            flight.status[-1][name] = status
            if (fault := vehicle.fault(step, truth)) is not None:
                flight.faults.append(fault)
        if flight.faults:
            break
    return flight


def up_and_down(time: float, name: str) -> Request:
    if time < 0.5:
        return Request.REST
    if time < 1.0:
        return Request.ARM
    return Request.TAKE_OFF if time < 9.0 else Request.LAND


def climb(state: Odometry) -> float:
    return float(Rotation.from_quat(state.q_NB).apply(state.v_NB_B)[2])


def tilt(state: Odometry) -> float:
    return math.acos(min(1.0, Rotation.from_quat(state.q_NB).as_matrix()[2, 2]))


@pytest.mark.parametrize("overrides", [HUMMINGBIRD, CRAZYFLIE], ids=["hummingbird", "crazyflie"])
@pytest.mark.parametrize("seed", range(2))
def test_up_and_down(overrides: tuple[str, ...], seed: int) -> None:
    flight = fly(overrides, seed, 16.0, up_and_down)
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
        assert max(tilt(state) for state in flight.during(name, M.LANDING)) < math.radians(12.0)
        assert end.p_NB_N[2] == pytest.approx(rest, abs=1e-4)
        assert np.linalg.norm(end.v_NB_B) < 1e-3
        assert tilt(end) < 1e-3
        # 8 s on optic flow, and yaw held by the IMU.
        assert math.dist(end.p_NB_N[:2], place[:2]) < 0.5


def test_a_team_that_hears_nothing_on_the_ground_stays_there() -> None:
    def arm_the_leader(time: float, name: str) -> Request | None:
        return Request.ARM if time < 0.3 and name == "leader" else None

    flight = fly(HUMMINGBIRD, 1, 3.0, arm_the_leader)
    assert flight.modes("leader") == [M.IDLE, M.ARMED]
    assert flight.modes("follower_1") == [M.IDLE]
    assert flight.faults == []
