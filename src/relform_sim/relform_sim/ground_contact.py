"""Whether a vehicle that touches the ground has landed or crashed."""

import math

from relform_core.flight_modes import VehicleMode
from relform_core.measurements import Odometry
from relform_sim.faults import tilt_of

LIFTED = 0.1
"""Height above that at rest from which a vehicle has left the ground [m]; below, its feet may touch."""
TOUCHDOWN_SPEED_MAX = 1.0
"""Highest vertical speed at which a vehicle may land [m/s]."""
TOUCHDOWN_TILT_MAX = math.radians(20.0)
"""Largest tilt at which a vehicle may land [rad]."""
_STAYS_UP = frozenset({VehicleMode.TAKING_OFF, VehicleMode.HOVERING, VehicleMode.FLYING})


class GroundContact:
    """Watches one vehicle from step to step.

    Args:
        name: of the vehicle.
        leg_height: height of its origin at rest [m].
    """

    def __init__(self, name: str, leg_height: float) -> None:
        self.fault: str | None = None
        """Why the present contact is a crash, in one line; None: it is none."""
        self._name = name
        self._leg_height = leg_height
        self._before: Odometry | None = None
        """The state one step before, if the vehicle was in the air since it left the ground."""

    def update(self, truth: Odometry, mode: VehicleMode, *, touches: bool) -> None:
        """Take in the next step: true state, what the vehicle did until then, and whether a leg touches."""
        self.fault = None
        if not touches:
            is_lifted = float(truth.p_NB_N[2]) > self._leg_height + LIFTED
            if is_lifted or self._before is not None:
                self._before = truth
        elif self._before is not None:
            self.fault = self._crash(self._before, mode)
            self._before = None

    def _crash(self, before: Odometry, mode: VehicleMode) -> str | None:
        """Why it is a crash to touch the ground in a mode, given the state just before."""
        if mode in _STAYS_UP:
            return f"{self._name} touched the ground while {mode}"
        speed, tilt = -_climb(before), tilt_of(before)
        if speed > TOUCHDOWN_SPEED_MAX:
            allowed = f"at most {TOUCHDOWN_SPEED_MAX:g} m/s are allowed"
            return f"{self._name} hit the ground at {speed:.1f} m/s ({allowed})"
        if tilt > TOUCHDOWN_TILT_MAX:
            allowed = f"at most {math.degrees(TOUCHDOWN_TILT_MAX):.0f} deg are allowed"
            return f"{self._name} hit the ground tilted by {math.degrees(tilt):.0f} deg ({allowed})"
        return None


def _climb(state: Odometry) -> float:
    """Vertical speed in the world [m/s]."""
    x, y, z, w = state.q_NB.tolist()
    vx, vy, vz = state.v_NB_B.tolist()
    upright = 1.0 - 2.0 * (x * x + y * y)
    climb: float = 2.0 * (x * z - w * y) * vx + 2.0 * (y * z + w * x) * vy + upright * vz
    return climb
