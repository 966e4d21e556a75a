"""The lag of the rotors against numerical integration and by hand, and that no lag changes nothing."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from relform_controller.input_log import InputLog
from relform_controller.ocp.rotor_lag import RotorLag
from relform_core.measurements import TeamMeasurements, VehicleMeasurements
from relform_core.sensors.applied_rotor_speeds import APPLIED_ROTOR_SPEEDS, AppliedRotorSpeeds
from support.scenarios import paper_scenario
from support.world import Array

STARTS = np.array([[1.9, 1.2, 1.7, 2.4], [1.5, 1.6, 0.9, 1.75]])
"""Of two vehicles."""
COMMANDS = np.array([[1.2, 2.1, 1.7, 2.0], [1.8, 1.6, 1.4, 0.3]])


def integrated(time_constant: float, starts: Array, commands: Array, duration: float) -> tuple[Array, Array]:
    """Thrusts at the end and their mean."""

    def rate(_: float, y: Array) -> Array:
        thrusts = y[: starts.size]
        return np.concatenate([(commands.reshape(-1) - thrusts) / time_constant, thrusts])

    start = np.concatenate([starts.reshape(-1), np.zeros(starts.size)])
    end = solve_ivp(rate, (0.0, duration), start, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    return end[: starts.size].reshape(starts.shape), end[starts.size :].reshape(starts.shape) / duration


@pytest.mark.parametrize("time_constant", [0.01, 0.05, 0.2])
@pytest.mark.parametrize("duration", [0.004, 0.05, 0.125])
def test_end_and_mean_of_an_interval(time_constant: float, duration: float) -> None:
    lag = RotorLag(time_constant)
    end, mean = integrated(time_constant, STARTS, COMMANDS, duration)
    np.testing.assert_allclose(lag.after(STARTS, COMMANDS, duration), end, rtol=1e-9)
    np.testing.assert_allclose(lag.mean(STARTS, COMMANDS, duration), mean, rtol=1e-9)


def test_one_time_constant_by_hand() -> None:
    """From 1 N towards 2 N: 63 % of the way, and the rest of 1 N on average over the time constant."""
    lag, start, command = RotorLag(0.05), np.array([1.0]), np.array([2.0])
    assert lag.after(start, command, 0.05) == pytest.approx(2.0 - math.exp(-1.0))
    assert lag.mean(start, command, 0.05) == pytest.approx(2.0 - (1.0 - math.exp(-1.0)))


@pytest.mark.parametrize("time_constant", [0.0, 0.05])
def test_intervals_in_a_row(time_constant: float) -> None:
    lag = RotorLag(time_constant)
    commands = np.stack([COMMANDS, COMMANDS[::-1], STARTS + 0.1], axis=1)
    expected = [STARTS]
    for k in range(3):
        expected.append(lag.after(expected[-1], commands[:, k], 0.02))
    np.testing.assert_array_equal(lag.sequence(STARTS, commands, 0.02), np.stack(expected, axis=1))


def test_without_lag_thrusts_are_commands() -> None:
    lag = RotorLag(0.0)
    assert lag.after(STARTS, COMMANDS, 0.05) is COMMANDS
    assert lag.mean(STARTS, COMMANDS, 0.05) is COMMANDS
    assert lag.memory(0.05) == lag.decay(0.05) == 0.0


def test_the_log_of_inputs_carries_the_thrusts_of_the_rotors() -> None:
    """From a hover over three intervals, and again when a vehicle reports that it flew something else."""
    scenario, lag = paper_scenario().config, RotorLag(0.05)
    period_ns, names, hover = scenario.period_ns, scenario.team.vehicles, scenario.vehicle.hover_thrust
    log = InputLog(names, period_ns, scenario.vehicle)
    commands = np.random.default_rng(5).uniform(1.0, 2.5, (3, 3, 4))
    for interval, command in enumerate(commands):
        log.command(interval * period_ns, command[:, None])

    def expected() -> Array:
        thrusts = np.full((3, 4), hover)
        for command in commands:
            thrusts, _ = integrated(0.05, thrusts, command, 0.05)
        return thrusts

    np.testing.assert_allclose(log.rotors(3 * period_ns, lag).thrusts, expected(), rtol=1e-9)
    found = list(log.mean_thrusts(period_ns, 3 * period_ns, lag))
    assert len(found) == 2
    for interval, mean_thrusts in enumerate(found, start=1):
        before = log.rotors(interval * period_ns, lag).thrusts
        _, mean = integrated(0.05, before, commands[interval], 0.05)
        np.testing.assert_allclose(mean_thrusts, mean, rtol=1e-9)

    commands[1, 2] = 0.9
    speeds = np.sqrt(commands[1:, 2] / scenario.vehicle.thrust_coefficient)
    report = VehicleMeasurements(
        {APPLIED_ROTOR_SPEEDS.name: (AppliedRotorSpeeds(3 * period_ns, period_ns, speeds, None),)}
    )
    silent = VehicleMeasurements({})
    by_vehicle = dict(zip(names, (silent, silent, report), strict=True))
    log.acknowledge(TeamMeasurements(3, 3 * period_ns, by_vehicle))
    np.testing.assert_allclose(log.rotors(3 * period_ns, lag).thrusts, expected(), rtol=1e-9)
