"""What a vehicle flies when commands are good, bad, late, repeated or missing."""

import ast
import inspect
import math
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_core.flight_modes import Request, VehicleMode
from relform_core.ground_config import GroundConfig
from relform_core.load import load_scenario
from relform_core.measurements import RotorCommand
from relform_core.sensors.imu import Imu
from relform_core.sensors.optic_flow import OpticFlow
from relform_core.sensors.sonar import Sonar
from relform_core.units import GRAVITY
from relform_core.vehicle_config import FailsafeConfig
from relform_sim import autopilot, ceiling, evasion, failsafe, onboard, own_motion
from relform_sim.failsafe import Failsafe
from relform_sim.onboard import Onboard, OnboardCounts
from relform_sim.pilot import Readings

VEHICLE = load_scenario(Path(__file__).parents[3] / "config/scenarios/paper.yaml").config.vehicle
PERIOD_NS = 50_000_000


def command(step: int, n_predicted: int = 3, **changes: Any) -> RotorCommand:
    """Speeds that tell of which command, interval and rotor they are."""
    speeds = 200.0 + 10.0 * step + np.arange(n_predicted + 1)[:, np.newaxis] + 0.1 * np.arange(4)
    good = RotorCommand(step * PERIOD_NS, PERIOD_NS, speeds[0], speeds[1:])
    return replace(good, **changes)


def flown(step: int, interval: int) -> Any:
    return pytest.approx(200.0 + 10.0 * step + interval + 0.1 * np.arange(4))


def imu(q_NB: Any = (0.0, 0.0, 0.0, 1.0), w_NB_B: Any = (0.0, 0.0, 0.0)) -> Imu:
    return Imu(
        0, np.array(q_NB), np.eye(3), np.array(w_NB_B), np.eye(3), np.array([0.0, 0.0, GRAVITY]), np.eye(3)
    )


class Flight:
    """An onboard computer that is asked for one interval after the other."""

    def __init__(self) -> None:
        self.onboard = Onboard(VEHICLE, PERIOD_NS * 1e-9)
        self.height = 2.0
        self.step = -1

    def next(self, arrived: RotorCommand | None) -> Any:
        self.step += 1
        commands = () if arrived is None else (arrived,)
        optic_flow = OpticFlow(0, np.array([0.1, 0.2, -0.3]), np.eye(3))
        height = Sonar(0, self.height, 0.2, 10.0, 0.5)
        readings = Readings(imu(), optic_flow, height)
        return self.onboard.rotor_speeds(self.step * PERIOD_NS, commands, readings)


def test_good_commands_are_flown() -> None:
    flight = Flight()
    for step in range(4):
        assert flight.next(command(step)) == flown(step, 0)
    assert flight.onboard.counts == OnboardCounts()


def test_speeds_are_saturated() -> None:
    flight = Flight()
    speeds = flight.next(command(0, speeds=np.array([-5.0, 1e4, 300.0, 0.0])))
    low, high = VEHICLE.rotor_speed_min, VEHICLE.rotor_speed_max
    assert speeds.tolist() == [low, high, 300.0, low]
    late = Flight()
    late.next(command(0, predicted_speeds=np.full((2, 4), 1e4)))
    assert late.next(None).tolist() == [high] * 4


def test_the_predicted_sequence_replaces_missing_commands_until_it_ends() -> None:
    flight = Flight()
    flight.next(command(0, n_predicted=2))
    assert flight.next(None) == flown(0, 1)
    assert flight.next(None) == flown(0, 2)
    assert flight.onboard.counts == OnboardCounts(missing=2, replayed=2)
    failsafe = Failsafe(VEHICLE, 0.05).sink(imu(), OpticFlow(0, np.array([0.1, 0.2, -0.3]), np.eye(3)))
    assert flight.next(None) == pytest.approx(failsafe)
    assert flight.next(None) == pytest.approx(failsafe)
    assert flight.onboard.counts == OnboardCounts(missing=4, replayed=2, failsafe=2)
    assert flight.next(command(5)) == flown(5, 0)


def test_an_old_plan_is_flown_for_a_limited_time() -> None:
    flight = Flight()
    flight.onboard.set_limits(FailsafeConfig(plan_max_s=0.1, descent_speed_m_s=0.3))
    flight.next(command(0, n_predicted=5))
    assert [flight.next(None) == flown(0, interval) for interval in (1, 2, 3)] == [True, True, False]
    assert flight.onboard.counts == OnboardCounts(missing=3, replayed=2, failsafe=1)
    flight.onboard.set_limits(FailsafeConfig(plan_max_s=0.2, descent_speed_m_s=0.3))
    assert flight.next(None) == flown(0, 4)


def test_the_failsafe_sinks_at_the_configured_speed() -> None:
    flight = Flight()
    flight.next(command(0, n_predicted=0))
    slow = flight.next(None)
    flight.onboard.set_limits(FailsafeConfig(plan_max_s=1.0, descent_speed_m_s=0.8))
    fast = flight.next(None)
    # The thrust follows the speed times a gain of 3/s: m * 3 * (0.8 - 0.3).
    thrusts = [VEHICLE.thrust_coefficient * np.sum(speeds**2) for speeds in (slow, fast)]
    assert thrusts[0] - thrusts[1] == pytest.approx(VEHICLE.mass * 1.5)


def test_before_the_first_good_command_the_vehicle_hovers() -> None:
    flight = Flight()
    hover = Failsafe(VEHICLE, 0.05).hover(imu(), OpticFlow(0, np.array([0.1, 0.2, -0.3]), np.eye(3)))
    assert flight.next(None) == pytest.approx(hover)
    assert flight.next(command(1, period_ns=0)) == pytest.approx(hover)
    assert flight.onboard.counts == OnboardCounts(missing=1, rejected=1, hovered=2)
    assert flight.next(command(2)) == flown(2, 0)


@pytest.mark.parametrize(
    "bad",
    [
        pytest.param({"speeds": np.array([300.0, math.nan, 300.0, 300.0])}, id="nan"),
        pytest.param({"predicted_speeds": np.array([[300.0, math.inf, 300.0, 300.0]])}, id="inf in the plan"),
        pytest.param({"speeds": np.full(3, 300.0)}, id="three rotors"),
        pytest.param({"predicted_speeds": np.full((2, 5), 300.0)}, id="plan for five rotors"),
        pytest.param({"predicted_speeds": np.full(4, 300.0)}, id="flat plan"),
        pytest.param({"period_ns": 0}, id="no period"),
        pytest.param({"stamp_ns": 0}, id="no newer than the last"),
        pytest.param({"stamp_ns": 22 * PERIOD_NS}, id="more than a second early"),
    ],
)
def test_bad_commands_are_refused_counted_and_replaced_by_the_plan(bad: dict[str, Any]) -> None:
    flight = Flight()
    flight.next(command(0))
    assert flight.next(command(1, **bad)) == flown(0, 1)
    assert flight.onboard.counts == OnboardCounts(rejected=1, replayed=1)
    assert flight.next(command(2)) == flown(2, 0)


def test_a_command_may_have_an_empty_plan() -> None:
    flight = Flight()
    assert flight.next(command(0, n_predicted=0)) == flown(0, 0)
    flight.next(None)
    assert flight.onboard.counts == OnboardCounts(missing=1, failsafe=1)


def test_a_late_command_applies_from_its_stamp_on() -> None:
    flight = Flight()
    flight.next(command(0))
    assert flight.next(None) == flown(0, 1)
    assert flight.next(None) == flown(0, 2)
    assert flight.next(command(1)) == flown(1, 2)  # two steps late: its third interval is due
    assert flight.next(command(1)) == flown(1, 3)  # once more the same: refused, its plan goes on
    assert flight.next(command(4)) == flown(4, 1)
    assert flight.next(command(2)) == flown(4, 2)  # overtaken
    assert flight.onboard.counts == OnboardCounts(missing=2, rejected=2, replayed=6)


def test_it_tells_which_command_was_flown() -> None:
    flight = Flight()
    flown_steps = []
    for arrived in (None, command(1, n_predicted=1), None, None, command(3)):
        flight.next(arrived)
        stamp_ns = flight.onboard.flown_stamp_ns
        flown_steps.append(None if stamp_ns is None else stamp_ns // PERIOD_NS)
    assert flown_steps == [None, 1, 1, None, 3]


def test_an_early_command_is_kept_until_its_stamp() -> None:
    flight = Flight()
    flight.next(command(0))
    assert flight.next(command(3)) == flown(0, 1)
    assert flight.next(command(2)) == flown(2, 0)  # overtaken, but in time
    assert flight.next(None) == flown(3, 0)
    assert flight.next(command(3, speeds=np.full(4, 300.0))) == flown(3, 1)
    assert flight.onboard.counts == OnboardCounts(missing=1, rejected=1, replayed=2)


def test_of_two_early_commands_with_one_stamp_the_first_is_flown() -> None:
    flight = Flight()
    flight.next(command(2))
    flight.next(command(2, speeds=np.full(4, 300.0)))
    assert flight.next(None) == flown(2, 0)
    assert flight.onboard.counts == OnboardCounts(missing=1, rejected=1, hovered=2)


def test_near_the_ground_the_failsafe_switches_the_motors_off_for_good() -> None:
    flight = Flight()
    flight.height = -math.inf  # nearer than the sonar can measure, but there are commands
    flight.next(command(0, n_predicted=1))
    assert flight.next(None) == flown(0, 1)
    flight.height = 0.3
    assert min(flight.next(None)) > VEHICLE.rotor_speed_min
    flight.height = -math.inf
    assert min(flight.next(None)) > VEHICLE.rotor_speed_min  # it levels out until it has landed
    for arrived in (None, command(5)):
        assert flight.next(arrived).tolist() == [0.0] * 4
    assert flight.onboard.counts == OnboardCounts(missing=4, replayed=1, failsafe=2, disarmed=2, refused=1)


@pytest.mark.parametrize("module", [onboard, autopilot, ceiling, evasion, failsafe, own_motion])
def test_the_onboard_logic_cannot_see_the_truth(module: ModuleType) -> None:
    """The rules of import-linter are about modules; ground truth and localization share one type."""
    imported = {
        alias.name
        for node in ast.walk(ast.parse(inspect.getsource(module)))
        if isinstance(node, ast.Import | ast.ImportFrom)
        for alias in node.names
    }
    assert imported.isdisjoint({"Odometry", "TeamMeasurements", "VehicleMeasurements", "GROUND_TRUTH"})


def test_a_plan_has_its_own_period() -> None:
    flight = Flight()
    flight.next(command(0, period_ns=2 * PERIOD_NS))
    assert flight.next(None) == flown(0, 0)
    assert flight.next(None) == flown(0, 1)
    assert flight.next(None) == flown(0, 1)


def torque_and_thrust(speeds: Any) -> tuple[Any, float]:
    """Eq. Aerodynamics by the matrix of the paper, and the force along body z."""
    d, c_T, c_Q = VEHICLE.arm_length, VEHICLE.thrust_coefficient, VEHICLE.torque_coefficient
    matrix = np.array(
        [
            [c_T, c_T, c_T, c_T],
            [0.0, d * c_T, 0.0, -d * c_T],
            [-d * c_T, 0.0, d * c_T, 0.0],
            [c_Q, -c_Q, c_Q, -c_Q],
        ]
    )
    force, *torque = matrix @ np.square(speeds)
    return np.array(torque), float(force)


@pytest.mark.parametrize("yaw", [0.0, 1.0, 2.9, -2.0])
def test_failsafe_levels_at_any_yaw(yaw: float) -> None:
    # Right side down by 0.2, nose down by 0.1: it must roll left side down and pitch nose up.
    q_NB = Rotation.from_euler("ZYX", [yaw, 0.1, 0.2]).as_quat()
    still = OpticFlow(0, np.zeros(3), np.eye(3))
    torque, force = torque_and_thrust(Failsafe(VEHICLE, 0.05).sink(imu(q_NB), still))
    stiffness = 6.0**2 * np.array(VEHICLE.inertia)
    assert torque[:2] == pytest.approx([-0.2 * stiffness[0], -0.1 * stiffness[1]], rel=0.02)
    assert torque[2] == pytest.approx(0.0, abs=1e-12)
    # Weight, less what makes it sink, made up for the tilt.
    assert force == pytest.approx(VEHICLE.mass * (GRAVITY - 0.9) / (math.cos(0.1) * math.cos(0.2)))


def test_failsafe_brakes_the_vertical_speed_and_no_other() -> None:
    attitude = Rotation.from_euler("ZYX", [1.0, 0.5, -0.4])
    forces = []
    for v_NB_N in ([0.0, 0.0, 0.0], [2.0, -3.0, 0.0], [2.0, -3.0, 0.7]):
        optic_flow = OpticFlow(0, attitude.inv().apply(v_NB_N), np.eye(3))
        speeds = Failsafe(VEHICLE, 0.05).sink(imu(attitude.as_quat()), optic_flow)
        forces.append(torque_and_thrust(speeds)[1] * math.cos(0.5) * math.cos(0.4) / VEHICLE.mass)
    assert forces == pytest.approx([GRAVITY - 0.9, GRAVITY - 0.9, GRAVITY - 0.9 - 3.0 * 0.7])


def test_a_hover_holds_the_height_and_brakes_the_horizontal_speed() -> None:
    """The force per mass is the weight, and 1/s times the horizontal velocity against it."""
    for yaw in (0.0, 1.0, -2.5):
        level = Rotation.from_euler("z", yaw)
        moving = OpticFlow(0, level.inv().apply([0.8, -0.6, 0.2]), np.eye(3))
        torque, force = torque_and_thrust(Failsafe(VEHICLE, 0.05).hover(imu(level.as_quat()), moving))
        angle = math.atan2(1.0, GRAVITY)  # the speed is 1 m/s, the deceleration 1 m/s^2
        axis_B = level.inv().apply([-0.6, -0.8, 0.0])  # e_z x the direction of braking
        stiffness = 6.0**2 * np.array(VEHICLE.inertia)
        assert torque == pytest.approx(angle * axis_B * stiffness, abs=1e-9)
        assert force == pytest.approx(VEHICLE.mass * (GRAVITY - 3.0 * 0.2))


def test_failsafe_damps_all_rates() -> None:
    still = OpticFlow(0, np.zeros(3), np.eye(3))
    torque, _ = torque_and_thrust(Failsafe(VEHICLE, 0.05).sink(imu(w_NB_B=(0.5, -0.4, 0.1)), still))
    assert torque == pytest.approx(-12.0 * np.array(VEHICLE.inertia) * [0.5, -0.4, 0.1])


def test_failsafe_of_a_slow_loop_is_softer() -> None:
    still = OpticFlow(0, np.zeros(3), np.eye(3))
    torque, _ = torque_and_thrust(Failsafe(VEHICLE, 0.1).sink(imu(w_NB_B=(0.5, -0.4, 0.1)), still))
    assert torque == pytest.approx(-6.0 * np.array(VEHICLE.inertia) * [0.5, -0.4, 0.1])


def readings() -> Readings:
    flow = OpticFlow(0, np.zeros(3), np.eye(3))
    return Readings(imu(), flow, Sonar(0, 2.5, 0.25, 10.0, 0.5))


def test_a_newer_plan_is_flown_at_once_within_an_interval() -> None:
    computer = Onboard(VEHICLE, 0.05)
    computer.rotor_speeds(3 * PERIOD_NS, [command(3)], readings())
    assert computer.rotor_speeds(4 * PERIOD_NS, [], readings()) == flown(3, 1)
    assert computer.counts == OnboardCounts(missing=1, replayed=1)
    assert computer.update(4 * PERIOD_NS + 5_000_000, []) is None
    assert computer.update(4 * PERIOD_NS + 20_000_000, [command(4)]) == flown(4, 0)
    assert computer.flown_stamp_ns == 4 * PERIOD_NS
    assert computer.counts == OnboardCounts(missing=1), "the command came late, but not too late"
    assert computer.rotor_speeds(5 * PERIOD_NS, [], readings()) == flown(4, 1)
    assert computer.counts == OnboardCounts(missing=1, replayed=1), "one came in the interval before"


def test_a_late_plan_is_flown_from_where_it_is() -> None:
    computer = Onboard(VEHICLE, 0.05)
    computer.rotor_speeds(3 * PERIOD_NS, [command(3)], readings())
    computer.rotor_speeds(6 * PERIOD_NS, [], readings())
    assert computer.update(6 * PERIOD_NS + 5_000_000, [command(5)]) == flown(5, 1)
    assert computer.counts.replayed == 1


def test_a_vehicle_that_hovers_starts_to_fly_with_an_interval() -> None:
    computer = Onboard(VEHICLE, 0.05)
    computer.rotor_speeds(0, [], readings())
    assert computer.update(5_000_000, [command(0)]) is None
    assert computer.rotor_speeds(PERIOD_NS, [], readings()) == flown(0, 1)
    assert computer.counts == OnboardCounts(missing=1, hovered=1, replayed=1)


def test_within_an_interval_bad_commands_are_refused_and_early_ones_kept() -> None:
    computer = Onboard(VEHICLE, 0.05)
    computer.rotor_speeds(3 * PERIOD_NS, [command(3)], readings())
    assert computer.update(3 * PERIOD_NS + 5_000_000, [command(2), command(4)]) is None
    assert computer.counts.rejected == 1
    assert computer.rotor_speeds(4 * PERIOD_NS, [], readings()) == flown(4, 0)


def from_the_ground(height: float = 2.0) -> Onboard:
    return Onboard(VEHICLE, 0.05, GroundConfig(), height)


def asks(step: int, request: Request) -> RotorCommand:
    return command(step, n_predicted=0, request=request)


def test_on_the_ground_motors_are_off_or_idle_without_any_command() -> None:
    computer = from_the_ground()
    assert computer.rotor_speeds(0, [], readings()).tolist() == [0.0] * 4
    idle = [VEHICLE.rotor_speed_min] * 4
    assert computer.rotor_speeds(PERIOD_NS, [asks(1, Request.ARM)], readings()).tolist() == idle
    for step in range(2, 60):  # longer than any plan
        assert computer.rotor_speeds(step * PERIOD_NS, [], readings()).tolist() == idle
    assert computer.mode is VehicleMode.ARMED
    assert computer.counts == OnboardCounts(missing=59)


def test_a_request_that_makes_no_sense_is_counted_and_named() -> None:
    computer = from_the_ground()
    for step in range(3):
        assert computer.rotor_speeds(step * PERIOD_NS, [command(step)], readings()).tolist() == [0.0] * 4
    assert (computer.mode, computer.reason) == (VehicleMode.IDLE, "refuses to fly while idle")
    assert computer.counts == OnboardCounts(refused=3)


def test_a_stop_acts_as_it_arrives_even_if_it_is_for_later() -> None:
    computer = from_the_ground()
    computer.rotor_speeds(0, [asks(0, Request.ARM)], readings())
    assert computer.rotor_speeds(PERIOD_NS, [asks(5, Request.STOP)], readings()).tolist() == [0.0] * 4
    assert (computer.mode, computer.reason) == (VehicleMode.STOPPED, "asked to stop")


def flying() -> Onboard:
    """That has climbed to where the sonar of ``readings`` is, and has flown the command of step 3."""
    computer = from_the_ground(height=2.5)
    for step, request in enumerate((Request.ARM, Request.TAKE_OFF, Request.HOVER)):
        computer.rotor_speeds(step * PERIOD_NS, [asks(step, request)], readings())
    assert computer.rotor_speeds(3 * PERIOD_NS, [command(3)], readings()) == flown(3, 0)
    return computer


def test_nonsense_in_flight_leaves_the_plan_in_force_until_it_is_over() -> None:
    computer = flying()
    for later in (1, 2, 3):
        step = 3 + later
        speeds = computer.rotor_speeds(step * PERIOD_NS, [asks(step, Request.ARM)], readings())
        assert speeds == flown(3, later)
        assert (computer.mode, computer.reason) == (VehicleMode.FLYING, "refuses to arm while flying")
    computer.rotor_speeds(7 * PERIOD_NS, [asks(7, Request.ARM)], readings())
    assert computer.mode is VehicleMode.FAILSAFE
    assert computer.counts == OnboardCounts(refused=4, replayed=3, failsafe=1)


def test_a_failsafe_in_the_air_ends_with_new_commands() -> None:
    computer = flying()
    for step in range(4, 8):
        computer.rotor_speeds(step * PERIOD_NS, [], readings())
    assert (computer.mode, computer.reason) == (
        VehicleMode.FAILSAFE,
        "no command came, and the plan of the last one is over",
    )
    assert computer.rotor_speeds(8 * PERIOD_NS, [command(8)], readings()) == flown(8, 0)
    assert computer.mode is VehicleMode.FLYING
