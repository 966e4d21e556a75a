"""Logs of made-up flights: ground truth and decisions with chosen numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_core.load import LoadedScenario
from relform_core.measurements import Odometry, RotorCommand
from relform_core.names import EstimatorMode, SolverState
from relform_core.telemetry import (
    Decision,
    EstimatorReport,
    LeaderEstimate,
    PairEstimate,
    SolverReport,
    TeamReference,
    TeamState,
)

PERIOD_NS = 50_000_000

FORMATION = {
    ("leader", "follower_1"): (-1.0, -0.5, -0.5),
    ("leader", "follower_2"): (-1.0, 0.5, -0.5),
    ("follower_1", "leader"): (1.0, 0.5, 0.5),
    ("follower_1", "follower_2"): (0.0, 1.0, 0.0),
    ("follower_2", "leader"): (1.0, -0.5, 0.5),
    ("follower_2", "follower_1"): (0.0, -1.0, 0.0),
}
"""The paper's first formation, by (observer, target) [m]."""
COVARIANCE = np.diag([0.01, 0.02, 0.03, 0.05]) ** 2
"""Of the estimate of each pair; the leader's is four times as large."""


def odometry(
    stamp_ns: int, position: Sequence[float], yaw_deg: float, pitch_deg: float = 7.0, roll_deg: float = -4.0
) -> Odometry:
    """A true state, always tilted, because yaw must not depend on tilt."""
    attitude = Rotation.from_euler("ZYX", [yaw_deg, pitch_deg, roll_deg], degrees=True)
    return Odometry(
        stamp_ns=stamp_ns,
        p_NB_N=np.array(position, dtype=np.float64),
        q_NB=attitude.as_quat(),
        v_NB_B=np.array([1.5, -0.3, 0.2]),
        w_NB_B=np.array([0.1, -0.2, 0.4]),
        pose_covariance=np.zeros((6, 6)),
        twist_covariance=np.zeros((6, 6)),
    )


def decision(stamp_ns: int, phase: str = "A", **changes: Any) -> Decision:
    """A decision of the controller with its reference and solver report, and with changes."""
    speeds: Mapping[str, Sequence[float]] = changes.pop("speeds", {})
    solver = SolverReport(
        state=SolverState.STEP_LIMIT,
        fallback_reason="",
        objective=12.5,
        kkt_first=80.0,
        kkt=0.5,
        sqp_steps=2,
        qp_iterations=7,
        active_bounds=3,
        active_constraints=(),
        prepare_time=0.002,
        feedback_time=0.001,
    )
    reference = TeamReference(
        phase=phase,
        p_NB_N=np.array([1.0, 2.0, 3.0]),
        v_NB_N=np.array([2.0, 0.5, 0.1]),
        yaw_NB=1.5,
        formation={pair: np.array(position) for pair, position in FORMATION.items()},
    )
    pairs = tuple(
        PairEstimate(
            observer=observer,
            target=target,
            p_B1B2_C1__est=np.array(position) + 0.01,
            p_B1B2_C1__ref=np.array(position),
            yaw_I1I2=0.25,
            yaw_variance=0.04,
            yaw_held=False,
            covariance=COVARIANCE,
        )
        for (observer, target), position in FORMATION.items()
    )
    return Decision(
        step=stamp_ns // PERIOD_NS,
        stamp_ns=stamp_ns,
        commands={
            vehicle: RotorCommand(
                stamp_ns=stamp_ns,
                period_ns=PERIOD_NS,
                speeds=np.array(speeds.get(vehicle, [400.0, 410.0, 420.0, 430.0])),
                predicted_speeds=np.full((2, 4), 405.0),
            )
            for vehicle in ("leader", "follower_1", "follower_2")
        },
        solver=replace(solver, **_of(solver, changes)),
        state=TeamState(
            phase,
            pairs,
            leader_position_error=0.1,
            leader_yaw_error=-0.2,
            leader=LeaderEstimate(np.array([1.02, 2.0, 2.97]), 1.48, 4.0 * COVARIANCE),
            estimator=EstimatorReport(
                EstimatorMode.PREDICTED, "no sonar", nis=15.5, nis_dof=18, rejected=("a", "b")
            ),
        ),
        reference=replace(reference, **_of(reference, changes)),
    )


def _of(part: Any, changes: Mapping[str, Any]) -> dict[str, Any]:
    """The changes that are fields of a part."""
    return {name: value for name, value in changes.items() if hasattr(part, name)}


def perfect_builder(scenario: LoadedScenario, phases: Sequence[str]) -> FlightLogBuilder:
    """A flight without any error, one control step per entry of ``phases``, and the last tick after them."""
    builder = FlightLogBuilder(scenario)
    leader = np.array([1.0, 2.0, 3.0])
    yaw = np.degrees(1.5)
    for step in range(len(phases) + 1):
        stamp_ns = step * scenario.config.period_ns
        for vehicle in scenario.config.team.vehicles:
            offset = np.array(FORMATION.get(("leader", vehicle), (0.0, 0.0, 0.0)))
            place = leader + Rotation.from_euler("Z", yaw, degrees=True).apply(offset)
            builder.add_ground_truth(vehicle, odometry(stamp_ns, place.tolist(), float(yaw)))
        if step < len(phases):
            builder.add_decision(decision(stamp_ns, phases[step]))
    return builder
