"""Messages of a flight of three vehicles, for tests of the view."""

import numpy as np
from scipy.spatial.transform import Rotation

from relform_core.arrays import Array
from relform_core.measurements import Odometry
from relform_core.names import EstimatorMode, SolverState
from relform_core.scenario_config import ScenarioConfig
from relform_core.sensors.range_bearing import RangeBearing, RangeBearings
from relform_core.telemetry import (
    EstimatorReport,
    LeaderEstimate,
    PairEstimate,
    PerStep,
    SolverReport,
    TeamReference,
    TeamState,
)
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_live.scene.flight_data import FlightData
from support.scenarios import paper_scenario

YAW = 0.6
"""Of the leader [rad]; the followers differ."""
VELOCITY = np.array([1.2, -0.4, 0.1])
PLACES = {"follower_1": np.array([-1.0, -0.8, 0.2]), "follower_2": np.array([-1.1, 0.9, -0.3])}
"""Of the formation, in {mc} of the leader [m]."""


def paper_config() -> ScenarioConfig:
    return paper_scenario().config


def nanoseconds(time: float) -> int:
    return round(time * NANOSECONDS_PER_SECOND)


def leader_place(time: float) -> Array:
    return np.array([2.0, 1.0, 1.5]) + time * VELOCITY


def place_of(vehicle: str, time: float) -> Array:
    """Of a vehicle that flies without error [m]."""
    offset = PLACES.get(vehicle, np.zeros(3))
    return leader_place(time) + Rotation.from_euler("z", YAW).apply(offset)


def odometry(vehicle: str, time: float, error: Array | None = None) -> Odometry:
    """The truth; it is off its place by an error [m]."""
    p = place_of(vehicle, time) + (np.zeros(3) if error is None else error)
    yaw = YAW if vehicle == "leader" else YAW - 1.9
    q = Rotation.from_euler("ZYX", [yaw, 0.1, -0.2]).as_quat()
    zero = np.zeros((6, 6))
    return Odometry(nanoseconds(time), p, q, VELOCITY, np.array([0.1, -0.2, 0.3]), zero, zero)


def state(
    time: float, phase: str = "B", mode: EstimatorMode = EstimatorMode.MEASURED, reason: str = ""
) -> PerStep[TeamState]:
    """The team as estimated: the leader 0.1 m too high, follower_1 0.05 m too far ahead of its place."""
    pairs = tuple(
        PairEstimate(
            "leader", name, place + [0.05 * (name == "follower_1"), 0.0, 0.0], place, -1.9, 0.01, False
        )
        for name, place in PLACES.items()
    )
    leader = LeaderEstimate(leader_place(time) + [0.0, 0.0, 0.1], YAW, None)
    team = TeamState(phase, pairs, 0.1, 0.0, leader, EstimatorReport(mode, reason, 5.0, 6))
    return PerStep(round(20 * time), nanoseconds(time), team)


def reference(time: float) -> PerStep[TeamReference]:
    formation = {("leader", name): place for name, place in PLACES.items()}
    turned_back = Rotation.from_euler("z", 1.9)
    formation |= {(name, "leader"): turned_back.apply(-place) for name, place in PLACES.items()}
    team = TeamReference("B", leader_place(time) + [0.0, 0.3, 0.4], VELOCITY, YAW, formation)
    return PerStep(round(20 * time), nanoseconds(time), team)


def solver(
    time: float, solver_state: SolverState = SolverState.SOLVED, reason: str = ""
) -> PerStep[SolverReport]:
    report = SolverReport(solver_state, reason, 1.0, 2.0, 0.1, 2, 3, 1, (), 1e-3, 4.2e-4)
    return PerStep(round(20 * time), nanoseconds(time), report)


def bearings(time: float, *targets: str) -> RangeBearings:
    seen = {target: RangeBearing(target, 1.3, 0.4, -0.1, np.eye(3)) for target in targets}
    return RangeBearings(nanoseconds(time), seen)


def flown(until: float, start: float = 0.0, error: Array | None = None) -> FlightData:
    """A flight at 20 Hz; follower_1 is off its place by an error [m]."""
    data = FlightData(paper_config())
    for step in range(round(20 * start), round(20 * until) + 1):
        time = step / 20.0
        for vehicle in data.truths:
            data.take_truth(vehicle, odometry(vehicle, time, error if vehicle == "follower_1" else None))
            others = [other for other in data.truths if other != vehicle]
            data.take_sightings(vehicle, bearings(time, *others))
        data.take_state(state(time))
        data.take_reference(reference(time))
        data.take_solver(solver(time))
    return data
