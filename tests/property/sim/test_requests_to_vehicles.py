"""Whatever a team on the ground is asked, no vehicle crashes, and all land when they are asked to."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from relform_core.flight_modes import Request, VehicleMode
from relform_core.measurements import RotorCommand
from relform_sim.vehicle import Vehicle
from support.scenarios import FROM_GROUND, paper_scenario

CONFIG = paper_scenario(FROM_GROUND, "start.follower_yaw_max_deg=150").config
PERIOD_NS = CONFIG.period_ns
LAND_S = 14.0
"""Enough to sink from the height of take-off, and to stop a climb before [s]."""

Asked = tuple[float, dict[str, Request | None]]
"""For how long [s], and what is asked of each vehicle meanwhile; None: nothing is sent."""

requests = st.sampled_from(
    [Request.REST, Request.ARM, Request.TAKE_OFF, Request.TAKE_OFF, Request.HOVER, Request.LAND, None]
)
parts = st.tuples(st.floats(0.1, 3.0), st.fixed_dictionaries(dict.fromkeys(CONFIG.team.vehicles, requests)))


def command(step: int, request: Request | None) -> RotorCommand | None:
    if request is None:
        return None
    return RotorCommand(step * PERIOD_NS, PERIOD_NS, np.zeros(4), np.zeros((0, 4)), request)


@given(script=st.lists(parts, min_size=1, max_size=8), seed=st.integers(0, 1000))
@settings(max_examples=12, deadline=None)
def test_no_sequence_of_requests_ends_badly(script: list[Asked], seed: int) -> None:
    last: Asked = (LAND_S, dict.fromkeys(CONFIG.team.vehicles, Request.LAND))
    asked = [part for duration, part in [*script, last] for _ in range(round(duration * 20))]
    vehicles = {name: Vehicle(CONFIG, seed, name) for name in CONFIG.team.vehicles}
    for step in range(len(asked) + 1):
        sent = asked[step - 1] if step > 0 else {}
        truth = {}
        for name, vehicle in vehicles.items():
            truth[name] = vehicle.advance(step, command(step - 1, sent.get(name)))
        for vehicle in vehicles.values():
            vehicle.measure(step, truth)
            assert vehicle.fault(step, truth) is None
    for name, vehicle in vehicles.items():
        assert vehicle.mode in (VehicleMode.IDLE, VehicleMode.STOPPED)
        assert abs(truth[name].p_NB_N[2] - CONFIG.vehicle.leg_height) < 1e-3
        assert np.linalg.norm(truth[name].v_NB_B) < 1e-2
