"""Faults that end a flight: ground contact, collision, excessive tilt, a state that is not finite."""

import math
from collections.abc import Mapping, Sequence

from relform_core.constraints_config import Obstacle
from relform_core.measurements import Odometry
from relform_core.obstacles import clearance
from relform_core.vehicle_config import VehicleConfig


def find_fault(
    config: VehicleConfig,
    name: str,
    ground_truth: Mapping[str, Odometry],
    obstacles: Sequence[Obstacle] = (),
    *,
    may_land: bool = False,
) -> str | None:
    """The fault of the vehicle ``name`` in one line, given the true states of all; None: it has none.

    Ground contact is that of the body origin: the collision radius is that of the rotor plane. It is no fault
    of a vehicle that ``may_land``, which ``GroundContact`` watches.
    """
    own = ground_truth[name]
    own_state = (own.p_NB_N, own.q_NB, own.v_NB_B, own.w_NB_B)
    if not all(math.isfinite(value) for part in own_state for value in part.tolist()):
        return f"{name} has a state that is not finite: the simulation diverged"
    p_NB_N = own.p_NB_N.tolist()
    distances = {
        other: math.dist(p_NB_N, state.p_NB_N.tolist())
        for other, state in ground_truth.items()
        if other != name
    }
    nearest = min(distances, key=distances.__getitem__)
    if (apart := distances[nearest]) < config.separation_min:
        needed = f"at least {config.separation_min:g} m are needed"
        return f"{name} collided with {nearest} ({apart:.3f} m apart, {needed})"
    if obstacles and (free := float(clearance(obstacles, own.p_NB_N))) < config.collision_radius:
        needed = f"at least {config.collision_radius:g} m are needed"
        return f"{name} collided with an obstacle ({free:.3f} m from its surface, {needed})"
    if not may_land and (height := p_NB_N[2]) <= 0.0:
        return f"{name} touched the ground (at a height of {height:.2f} m, above 0 is needed)"
    if (tilt := tilt_of(own)) > config.tilt_max:
        limit = math.degrees(config.tilt_max)
        return f"{name} tilted by {math.degrees(tilt):.0f} deg (at most {limit:.0f} deg are allowed)"
    return None


def tilt_of(state: Odometry) -> float:
    """Angle between body z and the vertical [rad]."""
    x, y, z, w = state.q_NB.tolist()
    # q is a rotation by the tilt about a horizontal axis after one about body z: |(x, y)| = sin(tilt / 2).
    return 2.0 * math.atan2(math.hypot(x, y), math.hypot(z, w))
