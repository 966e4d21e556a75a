"""The log of a flight: from core types, from messages, and of a flight that was cut off."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from relform_analysis.flight.log import FlightLogBuilder
from relform_core.errors import BagError
from support.logs import FORMATION, decision, odometry, perfect_builder
from support.scenarios import paper_scenario

PERIOD_NS = 50_000_000


def header(stamp_ns: int) -> Any:
    seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
    return SimpleNamespace(stamp=SimpleNamespace(sec=seconds, nanosec=nanoseconds))


def vector(values: Any) -> Any:
    return SimpleNamespace(**dict(zip("xyzw", map(float, values), strict=False)))


def messages_of_step(stamp_ns: int) -> dict[str, Any]:
    """The same step as ``support.logs`` makes of core types, by topic."""
    decided = decision(stamp_ns)
    reference = decided.reference
    solver = {name: value for name, value in vars(decided.solver).items() if name != "state"}
    formation = [
        SimpleNamespace(observer_id=observer, target_id=target, position=vector(position))
        for (observer, target), position in reference.formation.items()
    ]
    pairs = [
        SimpleNamespace(
            observer_id=pair.observer,
            target_id=pair.target,
            position=vector(pair.p_B1B2_C1__est),
            yaw=pair.yaw_I1I2,
            yaw_variance=pair.yaw_variance,
        )
        for pair in decided.state.pairs
    ]
    messages: dict[str, Any] = {
        "/formation/reference": SimpleNamespace(
            phase=reference.phase,
            leader_position=vector(reference.p_NB_N),
            leader_velocity=vector(reference.v_NB_N),
            leader_yaw=reference.yaw_NB,
            formation=formation,
        ),
        "/formation/state": SimpleNamespace(pairs=pairs),
        "/formation/solver": SimpleNamespace(status=decided.solver.state, **solver),
        "/formation/events": SimpleNamespace(kind=0, source="", description=""),
        "/leader/imu": SimpleNamespace(),
    }
    for vehicle, command in decided.commands.items():
        messages[f"/{vehicle}/rotor_speeds"] = SimpleNamespace(speeds=command.speeds)
    for message in messages.values():
        message.header = header(stamp_ns)
    return messages


def truth_message(stamp_ns: int, yaw_deg: float) -> Any:
    state = odometry(stamp_ns, (1.0, -2.0, 3.0), yaw_deg)
    pose = SimpleNamespace(position=vector(state.p_NB_N), orientation=vector(state.q_NB))
    twist = SimpleNamespace(linear=vector(state.v_NB_B), angular=vector(state.w_NB_B))
    return SimpleNamespace(
        header=header(stamp_ns),
        pose=SimpleNamespace(pose=pose, covariance=np.zeros(36)),
        twist=SimpleNamespace(twist=twist, covariance=np.zeros(36)),
    )


def test_messages_and_core_types_make_the_same_log() -> None:
    from_core, from_messages = (FlightLogBuilder(paper_scenario()) for _ in range(2))
    for step in range(3):
        stamp_ns = 3_000_000_000 + step * PERIOD_NS
        for vehicle, yaw_deg in (("leader", 10.0), ("follower_1", -50.0), ("follower_2", 170.0)):
            from_core.add_ground_truth(vehicle, odometry(stamp_ns, (1.0, -2.0, 3.0), yaw_deg))
            from_messages.add(f"/{vehicle}/ground_truth", truth_message(stamp_ns, yaw_deg))
        from_core.add_decision(decision(stamp_ns))
        for topic, message in messages_of_step(stamp_ns).items():
            from_messages.add(topic, message)
    expected, log = from_core.build(), from_messages.build()
    assert log.phase == expected.phase == ("A", "A", "A")
    for name, array in vars(expected).items():
        if isinstance(array, np.ndarray):
            np.testing.assert_array_equal(getattr(log, name), array, err_msg=name)
    for name, values in expected.solver.items():
        np.testing.assert_array_equal(log.solver[name], values, err_msg=name)
    assert not log.faults


def test_shapes_and_axes() -> None:
    log = perfect_builder(paper_scenario(), ["A", "A", "B"]).build()
    assert log.p_NB_N.shape == (4, 3, 3)
    assert log.q_NB.shape == (4, 3, 4)
    assert log.rotor_speeds.shape == (3, 3, 4)
    assert log.step_ns.tolist() == [0, PERIOD_NS, 2 * PERIOD_NS]
    for (observer, target), position in FORMATION.items():
        pair = log.vehicles.index(observer), log.vehicles.index(target)
        np.testing.assert_array_equal(log.p_BB_C__ref[1][pair], position)
        np.testing.assert_allclose(log.p_BB_C__est[1][pair], np.add(position, 0.01))
    assert np.isnan(log.p_BB_C__ref[:, range(3), range(3)]).all()


def test_last_tick_without_all_vehicles_is_left_out() -> None:
    builder = perfect_builder(paper_scenario(), ["A", "A"])
    builder.add_ground_truth("leader", odometry(3 * PERIOD_NS, (0.0, 0.0, 2.0), 0.0))
    builder.add_decision(decision(3 * PERIOD_NS))
    log = builder.build()
    assert log.tick_ns.tolist() == [0, PERIOD_NS, 2 * PERIOD_NS]
    assert len(log.phase) == 2


def test_what_is_missing_is_nan() -> None:
    builder = FlightLogBuilder(paper_scenario())
    for vehicle in ("leader", "follower_1", "follower_2"):
        builder.add(f"/{vehicle}/ground_truth", truth_message(0, 20.0))
    messages = messages_of_step(0)
    builder.add("/formation/reference", messages["/formation/reference"])
    builder.add("/leader/rotor_speeds", messages["/leader/rotor_speeds"])
    assert builder.missing() is None
    log = builder.build()
    assert np.isfinite(log.rotor_speeds[0, 0]).all()
    assert np.isnan(log.rotor_speeds[0, 1:]).all()
    assert np.isnan(log.solver["kkt"]).all()
    assert np.isnan(log.p_BB_C__est).all()


def test_says_what_it_lacks() -> None:
    builder = FlightLogBuilder(paper_scenario())
    assert builder.missing() == "there is no message on /leader/ground_truth"
    for vehicle in ("leader", "follower_1", "follower_2"):
        builder.add_ground_truth(vehicle, odometry(0, (0.0, 0.0, 2.0), 0.0))
    assert builder.missing() == "there is no message on /formation/reference"
    builder.add_decision(decision(PERIOD_NS))
    assert builder.missing() == "/formation/reference and the ground truth have no instant in common"
    builder.add_decision(decision(0))
    assert builder.missing() is None


def test_faults_are_kept() -> None:
    builder = perfect_builder(paper_scenario(), ["A"])
    event = SimpleNamespace(
        header=header(PERIOD_NS), kind=2, source="follower_1", description="touches the ground"
    )
    builder.add("/formation/events", event)
    (fault,) = builder.build().faults
    assert (fault.stamp_ns, fault.source, fault.description) == (
        PERIOD_NS,
        "follower_1",
        "touches the ground",
    )


def test_unknown_vehicle_is_one_line() -> None:
    message = messages_of_step(0)["/formation/state"]
    message.pairs[0].target_id = "stranger"
    with pytest.raises(
        BagError, match=r"^/formation/state: names the vehicle 'stranger', which is not of the team$"
    ):
        FlightLogBuilder(paper_scenario()).add("/formation/state", message)


@pytest.mark.parametrize(
    ("topic", "needed"),
    [("/leader/ground_truth", True), ("/formation/solver", True), ("/leader/imu", False), ("/clock", False)],
)
def test_needs(topic: str, needed: bool) -> None:
    assert FlightLogBuilder.needs(topic) is needed
