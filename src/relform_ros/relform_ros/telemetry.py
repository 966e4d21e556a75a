"""State, reference and solver report of a controller to messages and back, bit for bit.

As in ``fields``, ``*_to_msg`` trusts its argument, ``*_from_msg`` raises ``RejectionError``.
"""

import math
from collections.abc import Collection, Iterable, Sequence

import numpy as np

from relform_core.arrays import Array
from relform_core.names import EstimatorMode, SolverState
from relform_core.telemetry import (
    EstimatorReport,
    LeaderEstimate,
    PairEstimate,
    PerStep,
    SolverReport,
    TeamReference,
    TeamState,
)
from relform_msgs.msg import FormationReference as FormationReferenceMsg
from relform_msgs.msg import FormationState as FormationStateMsg
from relform_msgs.msg import PairState as PairStateMsg
from relform_msgs.msg import RelativePosition as RelativePositionMsg
from relform_msgs.msg import SolverStatus as SolverStatusMsg
from relform_ros.fields import (
    WORLD_FRAME,
    covariance_from_msg,
    flat,
    header_from_msg,
    header_to_msg,
    point_to_msg,
    vector_from_msg,
    vector_to_msg,
)
from relform_ros.rejection import Reason, RejectionError

POSE_SIZE = 4
"""Of a covariance of position and yaw."""
UNKNOWN_COVARIANCE = [-1.0] + (POSE_SIZE**2 - 1) * [0.0]
"""As in REP-145 the first element says that a covariance is not known."""
UNKNOWN_MODE = 255
"""Mode in a message of an older version, which has neither leader nor estimator."""
NO_NIS = -1.0
"""In a message of a step without innovations."""


def state_to_msg(state: PerStep[TeamState]) -> FormationStateMsg:
    """The team as the controller sees it in one control step."""
    team = state.value
    msg = FormationStateMsg(
        header=header_to_msg(state.stamp_ns),
        step=state.step,
        phase=team.phase,
        pairs=[_pair_to_msg(pair) for pair in team.pairs],
        leader_position_error=team.leader_position_error,
        leader_yaw_error=team.leader_yaw_error,
    )
    if team.leader is not None:
        msg.leader_position = point_to_msg(team.leader.p_NB_N)
        msg.leader_yaw = team.leader.yaw_NB
        msg.leader_covariance = _covariance_to_msg(team.leader.covariance)
    if team.estimator is not None:
        msg.estimator_mode = int(team.estimator.mode)
        msg.estimator_reason = team.estimator.reason
        msg.nis = team.estimator.nis if team.estimator.nis_dof else NO_NIS
        msg.nis_dof = team.estimator.nis_dof
        msg.rejected = list(team.estimator.rejected)
    return msg


def state_from_msg(msg: FormationStateMsg, vehicles: Collection[str]) -> PerStep[TeamState]:
    """The team as the controller sees it in one control step.

    Args:
        vehicles: names of all vehicles of the team.
    Raises:
        RejectionError: see the module; also a pair that is unknown or named twice.
    """
    stamp_ns = header_from_msg(msg.header, "")
    _check_pairs(((pair.observer_id, pair.target_id) for pair in msg.pairs), vehicles)
    is_known = msg.estimator_mode != UNKNOWN_MODE
    state = TeamState(
        phase=msg.phase,
        pairs=tuple(_pair_from_msg(pair) for pair in msg.pairs),
        leader_position_error=_finite(msg.leader_position_error, "leader_position_error"),
        leader_yaw_error=_finite(msg.leader_yaw_error, "leader_yaw_error"),
        leader=_leader_from_msg(msg) if is_known else None,
        estimator=_estimator_from_msg(msg) if is_known else None,
    )
    return PerStep(msg.step, stamp_ns, state)


def _leader_from_msg(msg: FormationStateMsg) -> LeaderEstimate:
    return LeaderEstimate(
        p_NB_N=vector_from_msg(msg.leader_position, "leader_position"),
        yaw_NB=_finite(msg.leader_yaw, "leader_yaw"),
        covariance=_covariance_from_msg(msg.leader_covariance, "leader_covariance"),
    )


def _estimator_from_msg(msg: FormationStateMsg) -> EstimatorReport:
    if msg.estimator_mode not in tuple(EstimatorMode):
        known = ", ".join(f"{mode.value} ({mode.name})" for mode in EstimatorMode)
        raise RejectionError(
            Reason.INVALID, f"estimator_mode must be one of {known} (got {msg.estimator_mode})"
        )
    return EstimatorReport(
        mode=EstimatorMode(msg.estimator_mode),
        reason=msg.estimator_reason,
        nis=_finite(msg.nis, "nis") if msg.nis_dof else math.nan,
        nis_dof=msg.nis_dof,
        rejected=tuple(msg.rejected),
    )


def _pair_to_msg(pair: PairEstimate) -> PairStateMsg:
    return PairStateMsg(
        observer_id=pair.observer,
        target_id=pair.target,
        position=vector_to_msg(pair.p_B1B2_C1__est),
        reference=vector_to_msg(pair.p_B1B2_C1__ref),
        error=math.dist(pair.p_B1B2_C1__est, pair.p_B1B2_C1__ref),
        yaw=pair.yaw_I1I2,
        yaw_variance=pair.yaw_variance,
        yaw_held=pair.yaw_held,
        yaw_singular=pair.yaw_singular,
        covariance=_covariance_to_msg(pair.covariance),
    )


def _pair_from_msg(msg: PairStateMsg) -> PairEstimate:
    pair = f"of '{msg.target_id}' seen by '{msg.observer_id}'"
    if not msg.yaw_variance >= 0.0:
        raise RejectionError(
            Reason.INVALID, f"yaw_variance {pair} must not be negative (got {msg.yaw_variance})"
        )
    return PairEstimate(
        observer=msg.observer_id,
        target=msg.target_id,
        p_B1B2_C1__est=vector_from_msg(msg.position, f"position {pair}"),
        p_B1B2_C1__ref=vector_from_msg(msg.reference, f"reference {pair}"),
        yaw_I1I2=_finite(msg.yaw, f"yaw {pair}"),
        yaw_variance=msg.yaw_variance,
        yaw_held=msg.yaw_held,
        yaw_singular=msg.yaw_singular,
        covariance=_covariance_from_msg(msg.covariance, f"covariance {pair}"),
    )


def _covariance_to_msg(covariance: Array | None) -> Array:
    return np.array(UNKNOWN_COVARIANCE) if covariance is None else flat(covariance)


def _covariance_from_msg(values: Sequence[float], what: str) -> Array | None:
    return None if values[0] == -1.0 else covariance_from_msg(values, POSE_SIZE, what)


def reference_to_msg(reference: PerStep[TeamReference]) -> FormationReferenceMsg:
    """What the controller is asked to track in one control step."""
    team = reference.value
    return FormationReferenceMsg(
        header=header_to_msg(reference.stamp_ns, WORLD_FRAME),
        step=reference.step,
        phase=team.phase,
        leader_position=point_to_msg(team.p_NB_N),
        leader_velocity=vector_to_msg(team.v_NB_N),
        leader_yaw=team.yaw_NB,
        formation=[
            RelativePositionMsg(observer_id=observer, target_id=target, position=vector_to_msg(position))
            for (observer, target), position in team.formation.items()
        ],
    )


def reference_from_msg(msg: FormationReferenceMsg, vehicles: Collection[str]) -> PerStep[TeamReference]:
    """What the controller is asked to track in one control step.

    Args:
        vehicles: names of all vehicles of the team.
    Raises:
        RejectionError: see the module; also a pair that is unknown or named twice.
    """
    stamp_ns = header_from_msg(msg.header, WORLD_FRAME)
    _check_pairs(((pair.observer_id, pair.target_id) for pair in msg.formation), vehicles)
    reference = TeamReference(
        phase=msg.phase,
        p_NB_N=vector_from_msg(msg.leader_position, "leader_position"),
        v_NB_N=vector_from_msg(msg.leader_velocity, "leader_velocity"),
        yaw_NB=_finite(msg.leader_yaw, "leader_yaw"),
        formation={
            (pair.observer_id, pair.target_id): vector_from_msg(
                pair.position, f"position of '{pair.target_id}' relative to '{pair.observer_id}'"
            )
            for pair in msg.formation
        },
    )
    return PerStep(msg.step, stamp_ns, reference)


def solver_to_msg(report: PerStep[SolverReport]) -> SolverStatusMsg:
    """What the solver did in one control step."""
    solver = report.value
    return SolverStatusMsg(
        header=header_to_msg(report.stamp_ns),
        step=report.step,
        status=int(solver.state),
        fallback_reason=solver.fallback_reason,
        objective=float(solver.objective),
        kkt_first=float(solver.kkt_first),
        kkt=float(solver.kkt),
        sqp_steps=solver.sqp_steps,
        qp_iterations=solver.qp_iterations,
        active_bounds=solver.active_bounds,
        active_constraints=list(solver.active_constraints),
        prepare_time=solver.prepare_time,
        feedback_time=solver.feedback_time,
    )


def solver_from_msg(msg: SolverStatusMsg) -> PerStep[SolverReport]:
    """What the solver did in one control step; objective and KKT values are as sent, NaN included.

    Raises:
        RejectionError: see the module; also an unknown status.
    """
    stamp_ns = header_from_msg(msg.header, "")
    if msg.status not in tuple(SolverState):
        known = ", ".join(f"{state.value} ({state.name})" for state in SolverState)
        raise RejectionError(Reason.INVALID, f"status must be one of {known} (got {msg.status})")
    report = SolverReport(
        state=SolverState(msg.status),
        fallback_reason=msg.fallback_reason,
        objective=msg.objective,
        kkt_first=msg.kkt_first,
        kkt=msg.kkt,
        sqp_steps=msg.sqp_steps,
        qp_iterations=msg.qp_iterations,
        active_bounds=msg.active_bounds,
        active_constraints=tuple(msg.active_constraints),
        prepare_time=_finite(msg.prepare_time, "prepare_time"),
        feedback_time=_finite(msg.feedback_time, "feedback_time"),
    )
    return PerStep(msg.step, stamp_ns, report)


def _check_pairs(pairs: Iterable[tuple[str, str]], vehicles: Collection[str]) -> None:
    seen: set[tuple[str, str]] = set()
    for observer, target in pairs:
        if observer not in vehicles or target not in vehicles or observer == target:
            raise RejectionError(
                Reason.FOREIGN, f"'{observer}' and '{target}' are no two vehicles of {', '.join(vehicles)}"
            )
        if (observer, target) in seen:
            raise RejectionError(Reason.INVALID, f"the pair '{observer}', '{target}' is named twice")
        seen.add((observer, target))


def _finite(value: float, what: str) -> float:
    if not math.isfinite(value):
        raise RejectionError(Reason.INVALID, f"{what} must be finite (got {value})")
    return value
