"""Whether a controller that was started in flight can take vehicles over, by what they say and measure."""

import math

from relform_core.flight_modes import ON_THE_GROUND, VehicleMode
from relform_core.measurements import VehicleMeasurements
from relform_core.sensors.flight_status import FLIGHT_STATUS
from relform_core.sensors.sonar import SONAR

HEIGHT_MIN = 0.4
"""A vehicle that sinks and is lower is left to land: it would touch the ground before it climbs [m]."""
GAP_MAX_S = 1.0
"""A controller that has decided nothing for longer takes the team over again [s]: the vehicles have flown its
last plan to the end and sink."""
_SINKS = frozenset({VehicleMode.FAILSAFE, VehicleMode.LANDING})


def take_over_problem(name: str, measured: VehicleMeasurements) -> str | None:
    """Why a vehicle cannot be taken over, in words; None: it can, or does not say what it does."""
    status, sonar = measured.newest(FLIGHT_STATUS), measured.newest(SONAR)
    if status is None:
        return None
    if status.mode in ON_THE_GROUND:
        return f"{name} is on the ground ({status.mode})"
    if status.mode in _SINKS and sonar is not None and sonar.range < HEIGHT_MIN:
        height = max(sonar.range, 0.0) if math.isfinite(sonar.range) else 0.0
        return f"{name} sinks, {height:.2f} m above the ground (at least {HEIGHT_MIN:g} m are needed)"
    return None
