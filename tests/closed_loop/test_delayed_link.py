"""The team flies over a link that delays measurements and commands, as long as the delay is short."""

import numpy as np
import pytest

from relform_analysis.flight.simulate import SimulatedStep, simulate
from relform_controller.blas import one_blas_thread
from relform_core.sensors.imu import IMU
from support.links import DELAY_STEPS, delayed_link
from support.nodes import short
from support.scenarios import paper_scenario

CALM = ("controller.period_s=0.02", "controller.horizon_steps=30", "controller.weights.torque_per_n2_m2=100")
"""Short steps and a gentle controller: raw feedback takes an old measurement for the present state."""
SCENARIO = paper_scenario(short(8.0), *CALM, seed=2)
PERIOD_NS = SCENARIO.config.period_ns


@pytest.fixture(scope="module")
def flown() -> list[SimulatedStep]:
    with one_blas_thread():
        return list(simulate(SCENARIO, delayed_link))


def test_the_flight_is_bounded(flown: list[SimulatedStep]) -> None:
    assert len(flown) == SCENARIO.config.n_steps + 1
    assert not any(step.faults for step in flown)
    places = {"leader": [0.0, 0.0, 0.0], **SCENARIO.config.formations["initial"]}
    for step in flown:
        leader = step.ground_truth["leader"].p_NB_N
        for name, place in places.items():
            off = step.ground_truth[name].p_NB_N - leader - np.array(place)
            assert np.linalg.norm(off) < 0.4
        assert np.linalg.norm(leader - SCENARIO.config.start.position) < 0.4


def test_measurements_keep_their_stamps_and_arrive_later(flown: list[SimulatedStep]) -> None:
    for k, step in enumerate(flown):
        assert step.measurements.arrival_ns == k * PERIOD_NS
        for measurements in step.measurements.by_vehicle.values():
            stamps_ns = {each.stamp_ns for arrived in measurements.by_sensor.values() for each in arrived}
            assert stamps_ns == ({(k - DELAY_STEPS) * PERIOD_NS} if k >= DELAY_STEPS else set())
    measured = flown[50].measurements.by_vehicle["follower_1"].newest(IMU)
    truth = [flown[k].ground_truth["follower_1"].w_NB_B for k in range(51)]
    assert measured is not None
    errors = [np.linalg.norm(measured.w_NB_B - w_NB_B) for w_NB_B in truth[46:]]
    assert np.argmin(errors) == 50 - DELAY_STEPS - 46


def test_the_controller_waits_for_the_first_measurements(flown: list[SimulatedStep]) -> None:
    decided = [step.decision is not None for step in flown]
    assert decided == [False] * DELAY_STEPS + [True] * (len(flown) - DELAY_STEPS - 1) + [False]
