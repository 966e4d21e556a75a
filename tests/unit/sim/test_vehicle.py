"""The simulated quadrotor: start, commands, events, seeds, and the order of calls."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_core.errors import FlightError
from relform_core.load import load_scenario
from relform_core.measurements import Odometry, RotorCommand, VehicleMeasurements
from relform_core.scenario_config import ScenarioConfig
from relform_core.sensors.applied_rotor_speeds import APPLIED_ROTOR_SPEEDS
from relform_core.sensors.imu import IMU
from relform_core.sensors.range_bearing import RANGE_BEARING
from relform_core.units import GRAVITY
from relform_sim.vehicle import Vehicle
from support.scenarios import NOISE_FREE

PAPER = Path(__file__).parents[3] / "config/scenarios/paper.yaml"
START = ("start.position_m=[1.0, 2.0, 3.0]", "start.yaw_deg=30.0")
EXACT = ("vehicle.mass_std_percent=0.0", "vehicle.inertia_std_percent=0.0")


def load(*overrides: str) -> ScenarioConfig:
    return load_scenario(PAPER, [*START, *overrides]).config


CONFIG = load()
HOVER = CONFIG.vehicle.hover_speed
UNEVEN = HOVER + np.array([1.0, -2.0, 3.0, -1.5])


def command(step: int, speeds: Any = UNEVEN) -> RotorCommand:
    """For [t_step, t_{step + 1}]; its plan goes on for two intervals with the same speeds."""
    return RotorCommand(step * CONFIG.period_ns, CONFIG.period_ns, np.array(speeds), np.tile(speeds, (2, 1)))


@dataclass
class Flight:
    """A flown team: per step, what every vehicle was and measured."""

    vehicles: dict[str, Vehicle]
    ground_truth: list[dict[str, Odometry]] = field(default_factory=list)
    measurements: list[dict[str, VehicleMeasurements]] = field(default_factory=list)

    def states(self, name: str) -> list[list[float]]:
        truth = [step[name] for step in self.ground_truth]
        return [[*s.p_NB_N.tolist(), *s.q_NB.tolist(), *s.v_NB_B.tolist(), *s.w_NB_B.tolist()] for s in truth]

    def v_NB_N(self, name: str, step: int) -> Any:
        state = self.ground_truth[step][name]
        return Rotation.from_quat(state.q_NB).apply(state.v_NB_B)


def fly(
    config: ScenarioConfig,
    n_steps: int,
    seed: int = 1,
    commands: Callable[[int], RotorCommand | None] = command,
) -> Flight:
    """The team under open-loop commands, the same for all."""
    vehicles = {name: Vehicle(config, seed, name) for name in config.team.vehicles}
    flight = Flight(vehicles)
    for step in range(n_steps + 1):
        arriving = commands(step - 1) if step > 0 else None
        truth = {name: vehicle.advance(step, arriving) for name, vehicle in vehicles.items()}
        flight.ground_truth.append(truth)
        flight.measurements.append({name: v.measure(step, truth) for name, v in vehicles.items()})
    return flight


def hovering(step: int) -> RotorCommand:
    return command(step, np.full(4, HOVER))


def events(*items: str) -> str:
    return f"events=[{', '.join(items)}]"


def test_team_starts_at_rest_in_its_first_formation() -> None:
    truth = fly(CONFIG, 0).ground_truth[0]
    cosine, sine = math.cos(math.radians(30.0)), math.sin(math.radians(30.0))
    assert truth["leader"].p_NB_N == pytest.approx([1.0, 2.0, 3.0])
    # follower_1 at (-1, -0.5, -0.5), follower_2 at (-1, 0.5, -0.5) in the leader's control frame
    assert truth["follower_1"].p_NB_N == pytest.approx(
        [1.0 - cosine + 0.5 * sine, 2.0 - sine - 0.5 * cosine, 2.5]
    )
    assert truth["follower_2"].p_NB_N == pytest.approx(
        [1.0 - cosine - 0.5 * sine, 2.0 - sine + 0.5 * cosine, 2.5]
    )
    for state in truth.values():
        assert state.stamp_ns == 0
        assert Rotation.from_quat(state.q_NB).as_euler("ZYX") == pytest.approx([math.radians(30.0), 0.0, 0.0])
        assert not state.v_NB_B.any()
        assert not state.w_NB_B.any()


def test_nominal_vehicle_hovers_and_measures_g() -> None:
    flight = fly(load(*EXACT), 20, commands=hovering)
    for name in CONFIG.team.vehicles:
        start, end = flight.ground_truth[0][name], flight.ground_truth[-1][name]
        assert end.p_NB_N == pytest.approx(start.p_NB_N, abs=1e-9)
        assert end.stamp_ns == 1_000_000_000
    forces = [measured["leader"].newest(IMU).f_NB_B for measured in flight.measurements]
    assert np.mean(forces, axis=0) == pytest.approx([0.0, 0.0, GRAVITY], abs=0.05)


@pytest.mark.parametrize(
    ("overrides", "time_constant"),
    [
        ((), 0.0),
        (("vehicle.rotor_time_constant_s=0.03",), 0.03),
        (("vehicle.rotor_time_constant_s=0.03", "plant.rotor_time_constant_s=0.05"), 0.05),
        (("vehicle.rotor_time_constant_s=0.03", "plant.rotor_time_constant_s=0"), 0.0),
    ],
)
def test_the_plant_may_have_another_lag_than_the_controller_knows(
    overrides: tuple[str, ...], time_constant: float
) -> None:
    """By the specific force after one interval of a higher command."""
    config = load(*EXACT, "sensors.imu.accelerometer_std_m_s2=0", *overrides)
    flight = fly(config, 1, commands=lambda step: command(step, np.full(4, 1.1 * HOVER)))
    remaining = 0.0 if time_constant == 0.0 else math.exp(-0.05 / time_constant)
    force = flight.measurements[1]["leader"].newest(IMU).f_NB_B
    assert force == pytest.approx([0.0, 0.0, GRAVITY * (1.1 - 0.1 * remaining) ** 2])


def test_the_plant_may_have_another_drag_than_the_controller_knows() -> None:
    """By the specific force of a vehicle that rises faster and faster, level."""
    known = ("vehicle.drag_coefficient_n_s_m=[0.0, 0.0, 0.5]", "sensors.imu.accelerometer_std_m_s2=0")
    forces, climbs = [], []
    for overrides in (known, (*known, "plant.drag_coefficient_n_s_m=[0.0, 0.0, 0.2]")):
        flight = fly(
            load(*EXACT, *overrides), 4, commands=lambda step: command(step, np.full(4, 1.1 * HOVER))
        )
        forces.append(flight.measurements[4]["leader"].newest(IMU).f_NB_B[2])
        climbs.append(flight.v_NB_N("leader", 4)[2])
    for force, climb, drag in zip(forces, climbs, (0.5, 0.2), strict=True):
        assert climb > 0.3
        assert force == pytest.approx(1.21 * GRAVITY - drag * climb / CONFIG.vehicle.mass)


def test_true_vehicles_differ_from_the_nominal_one_and_from_each_other() -> None:
    config = load("sensors.imu.accelerometer_std_m_s2=0.0")
    flight = fly(config, 1, commands=hovering)
    masses = {
        name: 4.0 * config.vehicle.hover_thrust / measured.newest(IMU).f_NB_B[2]
        for name, measured in flight.measurements[0].items()
    }
    assert len(set(masses.values())) == 3
    for name, mass in masses.items():
        assert mass == pytest.approx(config.vehicle.mass, rel=0.031)
        # Newton: what it weighs too much makes it sink
        sunk = flight.v_NB_N(name, 1)[2] / 0.05
        assert sunk == pytest.approx(4.0 * config.vehicle.hover_thrust / mass - GRAVITY, abs=1e-9)


def test_equal_seeds_give_equal_bits_and_another_seed_another_flight() -> None:
    first, again, other = fly(CONFIG, 10, seed=4), fly(CONFIG, 10, seed=4), fly(CONFIG, 10, seed=5)
    for name in CONFIG.team.vehicles:
        assert first.states(name) == again.states(name)
        assert first.states(name) != other.states(name)
    imus = [
        flight.measurements[10]["follower_2"].newest(IMU).w_NB_B.tolist() for flight in (first, again, other)
    ]
    assert imus[0] == imus[1] != imus[2]


def test_range_bearing_is_between_the_returned_ground_truths() -> None:
    flight = fly(load("sensors.range_bearing.position_std_m=1.0e-9"), 5)
    truth = flight.ground_truth[5]
    for name, measured in flight.measurements[5].items():
        for target, seen in measured.newest(RANGE_BEARING).by_target.items():
            assert seen.range == pytest.approx(math.dist(truth[name].p_NB_N, truth[target].p_NB_N), abs=1e-7)
        assert list(measured.newest(RANGE_BEARING).by_target) == [
            n for n in CONFIG.team.vehicles if n != name
        ]


def test_wind_acts_on_its_target_while_it_lasts() -> None:
    wind = "{kind: wind, start_s: 0.1, end_s: 0.3, target: follower_1, force_n: [0.3, -0.2, 0.1]}"
    flight = fly(load(*EXACT, events(wind)), 10, commands=hovering)
    gained = np.array([0.3, -0.2, 0.1]) / CONFIG.vehicle.mass * 0.2
    assert flight.v_NB_N("follower_1", 2) == pytest.approx(np.zeros(3), abs=1e-9)
    assert flight.v_NB_N("follower_1", 4) == pytest.approx(gained / 2.0)
    assert flight.v_NB_N("follower_1", 6) == pytest.approx(gained)
    assert flight.v_NB_N("follower_1", 10) == pytest.approx(gained)
    assert flight.v_NB_N("follower_2", 10) == pytest.approx(np.zeros(3), abs=1e-9)


def test_simultaneous_winds_add_and_thrust_scales_multiply() -> None:
    span = "start_s: 0.0, end_s: 0.1, target: leader"
    winds = [f"{{kind: wind, {span}, force_n: [{force}, 0.0, 0.0]}}" for force in (0.3, -0.1)]
    scales = [f"{{kind: thrust_scale, {span}, scale: {scale}}}" for scale in (0.9, 0.8)]
    flight = fly(load(*EXACT, events(*winds, *scales)), 4, commands=hovering)
    expected = [0.2 / CONFIG.vehicle.mass * 0.1, 0.0, (0.9 * 0.8 - 1.0) * GRAVITY * 0.1]
    assert flight.v_NB_N("leader", 2) == pytest.approx(expected)
    assert flight.v_NB_N("leader", 4) == pytest.approx(expected)


def test_thrust_decays_to_its_floor_and_is_whole_again_after_the_event() -> None:
    """Intervals of 0.05 s; events act on whole intervals, as they are at the start."""
    decay = "{kind: thrust_decay, start_s: 0.05, end_s: 0.25, target: leader, rate_percent_s: 100}"
    short = decay.replace("rate_percent_s: 100", "rate_percent_s: 100, floor_percent: 90")
    for text, scales in ((decay, (1.0, 1.0, 0.95, 0.9, 0.85, 1.0)), (short, (1.0, 1.0, 0.95, 0.9, 0.9, 1.0))):
        flight = fly(load(*EXACT, events(text)), 6, commands=hovering)
        lost = np.cumsum([0.0, *(GRAVITY * 0.05 * (scale - 1.0) for scale in scales)])
        climbs = [flight.v_NB_N("leader", step)[2] for step in range(7)]
        assert climbs == pytest.approx(lost.tolist(), abs=1e-9)


def test_a_weak_rotor_turns_the_vehicle() -> None:
    weak = [
        f"{{kind: weak_rotor, start_s: 0.0, end_s: 1.0, target: leader, rotor: {rotor}, scale: {scale}}}"
        for rotor, scale in (("left", 0.9), ("front", 0.95))
    ]
    flight = fly(load(*EXACT, events(*weak)), 1, commands=hovering)
    rate = flight.ground_truth[1]["leader"].w_NB_B
    thrust = CONFIG.vehicle.hover_thrust
    lever = CONFIG.vehicle.arm_length * thrust * 0.05
    x, y, z = CONFIG.vehicle.inertia
    drag = CONFIG.vehicle.torque_coefficient / CONFIG.vehicle.thrust_coefficient * thrust * 0.05
    expected = [-0.1 * lever / x, 0.05 * lever / y, (0.1 - 0.05) * drag / z]
    assert rate == pytest.approx(expected, rel=2e-3)
    assert flight.v_NB_N("leader", 1)[2] == pytest.approx(-0.15 / 4.0 * GRAVITY * 0.05, rel=1e-3)


def test_lost_commands_are_replaced_by_the_plan_then_by_the_failsafe_of_that_vehicle_only() -> None:
    loss = "{kind: command_loss, start_s: 0.15, end_s: 0.4, target: follower_2, probability: 1.0}"
    reference, lossy = fly(CONFIG, 12), fly(load(events(loss)), 12)
    counts = lossy.vehicles["follower_2"].counts
    assert (counts.missing, counts.replayed, counts.failsafe, counts.rejected) == (5, 2, 3, 0)
    # The plan has the speeds of the lost commands: nothing changes while it lasts, in steps 3 and 4.
    assert lossy.states("follower_2")[:6] == reference.states("follower_2")[:6]
    assert lossy.states("follower_2")[6] != reference.states("follower_2")[6]
    for name in ("leader", "follower_1"):
        assert lossy.vehicles[name].counts.missing == 0
        assert lossy.states(name) == reference.states(name)


def test_commands_are_lost_with_the_specified_probability_and_change_no_other_draw() -> None:
    loss = "{kind: command_loss, start_s: 0.0, end_s: 100.0, target: leader, probability: 0.3}"
    n = 400
    lossy, reference = fly(load(events(loss)), n), fly(CONFIG, n)
    assert lossy.vehicles["leader"].counts.missing == pytest.approx(0.3 * n, abs=4.0 * math.sqrt(0.21 * n))

    def gyro_noise(flight: Flight) -> Any:
        return [
            measured["leader"].newest(IMU).w_NB_B - truth["leader"].w_NB_B
            for measured, truth in zip(flight.measurements, flight.ground_truth, strict=True)
        ]

    assert np.array(gyro_noise(lossy)) == pytest.approx(np.array(gyro_noise(reference)), abs=1e-9)


def test_a_dropped_imu_message_does_not_blind_the_vehicle_itself() -> None:
    dropout = "{kind: dropout, sensor: imu, start_s: 0.0, end_s: 9.0, target: leader, probability: 1.0}"
    blind, seeing = (
        fly(load(events(dropout)), 6, commands=lambda _: None),
        fly(CONFIG, 6, commands=lambda _: None),
    )
    assert all(measured["leader"].newest(IMU) is None for measured in blind.measurements)
    assert blind.vehicles["leader"].counts.hovered == 6
    assert blind.states("leader") == seeing.states("leader")


def test_commands_that_are_not_finite_do_not_reach_the_rotors() -> None:
    def broken(step: int) -> RotorCommand:
        return command(step) if step < 3 else command(step, np.full(4, math.nan))

    flight = fly(CONFIG, 12, commands=broken)
    assert np.isfinite(flight.states("leader")).all()
    assert flight.vehicles["leader"].counts.rejected == 9


def test_faults_name_the_vehicle() -> None:
    flight = fly(
        load("start.position_m=[0.0, 0.0, 0.6]"), 4, commands=lambda step: command(step, np.zeros(4))
    )
    truth, vehicles = flight.ground_truth[4], flight.vehicles
    assert "follower_1 touched the ground" in (vehicles["follower_1"].fault(4, truth) or "")
    assert vehicles["leader"].fault(4, truth) is None


def test_in_real_time_a_command_applies_when_it_arrives() -> None:
    config = load(*EXACT, *NOISE_FREE, "pacing=real_time")
    vehicles = {name: Vehicle(config, 0, name) for name in config.team.vehicles}
    leader, period_ns, factors = vehicles["leader"], config.period_ns, (1.02, 1.04, 1.06)
    speeds, acknowledged = [], []
    for step in range(4):
        if step > 0:
            commanded = factors[step - 1] * HOVER * np.ones(4)
            leader.receive(command(step - 1, commanded), (step - 1) * period_ns + 18_000_000)
        truth = {name: vehicle.advance(step) for name, vehicle in vehicles.items()}
        acknowledged.append(leader.measure(step, truth).newest(APPLIED_ROTOR_SPEEDS))
        for name in config.team.followers:
            vehicles[name].measure(step, truth)
        speeds.append(float(truth["leader"].v_NB_B[2]))
    # The first interval is a hover. In the others the last plan goes on until 20 ms after their start.
    lifts = [(factor**2 - 1.0) * GRAVITY for factor in factors]
    changes = [0.0, 0.02 * lifts[0] + 0.03 * lifts[1], 0.02 * lifts[1] + 0.03 * lifts[2]]
    assert np.diff(speeds) == pytest.approx(changes, abs=1e-6)
    assert acknowledged[-1] is not None
    mean = HOVER * math.sqrt(0.4 * 1.04**2 + 0.6 * 1.06**2)
    assert acknowledged[-1].speeds[-1] == pytest.approx(np.full(4, mean), rel=1e-12)
    assert acknowledged[-1].command_stamp_ns == 2 * period_ns
    assert leader.counts.missing == 1, "nothing had come before the first interval"


def advanced(*steps: int) -> Vehicle:
    vehicle, others = Vehicle(CONFIG, 0, "leader"), [Vehicle(CONFIG, 0, f"follower_{i}") for i in (1, 2)]
    truth = {f"follower_{i + 1}": other.advance(0, None) for i, other in enumerate(others)}
    for step in steps:
        truth["leader"] = vehicle.advance(step, command(step - 1))
        stamps = {name: replace(state, stamp_ns=step * CONFIG.period_ns) for name, state in truth.items()}
        vehicle.measure(step, stamps)
    return vehicle


def team_truth(step: int, names: Sequence[str] = CONFIG.team.vehicles) -> dict[str, Odometry]:
    return {
        name: replace(Vehicle(CONFIG, 0, name).advance(0, None), stamp_ns=step * CONFIG.period_ns)
        for name in names
    }


@pytest.mark.parametrize(
    ("misuse", "message"),
    [
        (lambda: Vehicle(CONFIG, 0, "follower_9"), "'follower_9' is not in the team, known are leader, "),
        (lambda: advanced(1), "leader: step 1 cannot follow step -1"),
        (lambda: advanced(0, 1, 3), "leader: step 3 cannot follow step 1"),
        (lambda: advanced(0, 0), "leader: step 0 cannot follow step 0"),
        (lambda: advanced(0).measure(1, team_truth(1)), "leader: asked about step 1, but it is at step 0"),
        (lambda: advanced(0).fault(1, team_truth(1)), "leader: asked about step 1, but it is at step 0"),
        (
            lambda: advanced(0).measure(0, team_truth(0, ["leader", "follower_1"])),
            "leader: ground truth of follower_2 is missing in step 0",
        ),
        (
            lambda: advanced(0).measure(0, team_truth(2)),
            "leader: ground truth of leader is stamped 100000000 ns, step 0 is at 0 ns",
        ),
    ],
)
def test_misuse_is_refused(misuse: Callable[[], object], message: str) -> None:
    with pytest.raises(FlightError) as error:
        misuse()
    assert str(error.value).startswith(message)


def test_a_step_that_was_not_measured_cannot_be_flown() -> None:
    vehicle = Vehicle(CONFIG, 0, "leader")
    vehicle.advance(0, None)
    with pytest.raises(FlightError, match="leader: step 0 was not measured before step 1"):
        vehicle.advance(1, command(0))


def test_the_tilt_limit_can_be_changed_and_nothing_else_changes() -> None:
    states, faults = [], []
    for limit in (None, "vehicle.tilt_max_deg=1.0"):
        vehicle = Vehicle(CONFIG, 1, "leader")
        others = {name: Vehicle(CONFIG, 1, name).advance(0, None) for name in CONFIG.team.followers}
        truth = others | {"leader": vehicle.advance(0, None)}
        vehicle.measure(0, truth)
        if limit is not None:
            vehicle.set_limits(load(limit, "vehicle.mass_kg=0.9").vehicle)
        tilted = vehicle.advance(1, command(0, HOVER + np.array([60.0, 0.0, -60.0, 0.0])))
        states.append(tilted.q_NB.tolist())
        now = {name: replace(state, stamp_ns=CONFIG.period_ns) for name, state in others.items()}
        faults.append(vehicle.fault(1, now | {"leader": tilted}))
    assert states[0] == states[1]
    assert faults[0] is None
    assert faults[1] is not None
    assert "at most 1 deg are allowed" in faults[1]
