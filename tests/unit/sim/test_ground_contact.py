"""A vehicle that touches the ground has landed, or crashed, for a reason."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_core.flight_modes import VehicleMode
from relform_core.measurements import Odometry
from relform_sim.ground_contact import GroundContact

M = VehicleMode
ZEROS = np.zeros((6, 6))


def state(height: float, sink: float = 0.3, tilt_deg: float = 5.0) -> Odometry:
    """With a yaw, and a horizontal velocity that is no fault."""
    attitude = Rotation.from_euler("z", 2.0) * Rotation.from_rotvec([0.0, math.radians(tilt_deg), 0.0])
    v_NB_B = attitude.inv().apply([0.4, -0.3, -sink])
    return Odometry(0, np.array([1.0, 2.0, height]), attitude.as_quat(), v_NB_B, np.zeros(3), ZEROS, ZEROS)


def fault_of(mode: VehicleMode, before: Odometry) -> str | None:
    """Of a vehicle that touches the ground after a state in the air."""
    contact = GroundContact("leader", 0.1)
    contact.update(before, mode, touches=False)
    assert contact.fault is None
    contact.update(state(0.1, sink=0.0), mode, touches=True)
    return contact.fault


@pytest.mark.parametrize("mode", [M.LANDING, M.FAILSAFE, M.STOPPED])
def test_a_soft_landing(mode: VehicleMode) -> None:
    assert fault_of(mode, state(0.25)) is None


@pytest.mark.parametrize("mode", [M.TAKING_OFF, M.HOVERING, M.FLYING])
def test_whatever_should_stay_in_the_air_crashes(mode: VehicleMode) -> None:
    assert fault_of(mode, state(0.25)) == f"leader touched the ground while {mode}"


def test_a_landing_that_is_too_fast_or_too_tilted() -> None:
    too_fast = "leader hit the ground at 1.2 m/s (at most 1 m/s are allowed)"
    assert fault_of(M.LANDING, state(0.25, sink=1.2)) == too_fast
    assert fault_of(M.STOPPED, state(0.25, sink=1.2)) == too_fast
    too_tilted = "leader hit the ground tilted by 23 deg (at most 20 deg are allowed)"
    assert fault_of(M.FAILSAFE, state(0.25, tilt_deg=23.0)) == too_tilted


def test_feet_may_touch_while_a_vehicle_leaves_the_ground() -> None:
    contact = GroundContact("leader", 0.1)
    for height, touches in ((0.1, True), (0.13, False), (0.1, True), (0.15, False), (0.1, True)):
        contact.update(state(height), M.TAKING_OFF, touches=touches)
        assert contact.fault is None
    contact.update(state(0.25), M.TAKING_OFF, touches=False)
    contact.update(state(0.15), M.TAKING_OFF, touches=False)  # it has left, however low it is now
    contact.update(state(0.1), M.TAKING_OFF, touches=True)
    assert contact.fault == "leader touched the ground while taking off"


def test_a_landed_vehicle_may_rock_on_its_legs() -> None:
    contact = GroundContact("leader", 0.1)
    contact.update(state(0.25), M.LANDING, touches=False)
    contact.update(state(0.1), M.LANDING, touches=True)
    for height, touches in ((0.12, False), (0.1, True)):
        contact.update(state(height, sink=1.5), M.IDLE, touches=touches)
        assert contact.fault is None
