"""Events of a flight to messages and back, and the formations that events and requests hold.

As in ``fields``, ``*_to_msg`` trusts its argument, ``*_from_msg`` raises ``RejectionError``.
"""

from collections.abc import Iterable, Mapping

import numpy as np

from relform_core.flight_modes import TeamRequest
from relform_core.names import EventKind
from relform_core.schema import Vector3
from relform_core.team_config import TeamConfig
from relform_core.telemetry import (
    AlarmRaised,
    Event,
    EventContent,
    FaultReported,
    FormationSet,
    ParametersSet,
    PerStep,
    RequestMade,
    StepDecided,
    TakenOver,
)
from relform_msgs.msg import FormationEvent as FormationEventMsg
from relform_msgs.msg import RelativePosition as RelativePositionMsg
from relform_ros.fields import (
    check_lengths,
    header_from_msg,
    header_to_msg,
    stamp_from_msg,
    stamp_to_msg,
    vector_from_msg,
    vector_to_msg,
)
from relform_ros.rejection import Reason, RejectionError


def event_to_msg(event: PerStep[Event], team: TeamConfig) -> FormationEventMsg:
    """An event of a flight."""
    msg = FormationEventMsg(header=header_to_msg(event.stamp_ns), step=event.step, source=event.value.source)
    match event.value.content:
        case StepDecided(inputs, sqp_steps, waiting_for):
            msg.kind = EventKind.STEP.value
            msg.description = waiting_for
            msg.input_topics = [topic for topic, _ in inputs]
            msg.input_stamps = [stamp_to_msg(stamp_ns) for _, stamp_ns in inputs]
            msg.sqp_steps = sqp_steps
        case FormationSet(formation):
            msg.kind = EventKind.SET_FORMATION.value
            msg.description = "requested by service or parameters"
            msg.formation = formation_to_msgs(formation, team)
        case ParametersSet(changes):
            msg.kind = EventKind.SET_PARAMETERS.value
            msg.description = "changed by parameters"
            msg.parameter_names = list(changes)
            msg.parameter_values = list(changes.values())
        case RequestMade(request, values):
            msg.kind = EventKind.REQUEST.value
            msg.description = request.value
            msg.request_values = list(values)
        case TakenOver():
            msg.kind = EventKind.TAKE_OVER.value
            msg.description = "the controller was started in flight"
        case FaultReported(description):
            msg.kind = EventKind.FAULT.value
            msg.description = description
        case AlarmRaised(description):
            msg.kind = EventKind.ALARM.value
            msg.description = description
    return msg


def event_from_msg(msg: FormationEventMsg, team: TeamConfig) -> PerStep[Event]:
    """An event of a flight.

    Raises:
        RejectionError: see the module; also an unknown kind, or lists that differ in length.
    """
    stamp_ns = header_from_msg(msg.header, "")
    content: EventContent
    match msg.kind:
        case EventKind.STEP:
            check_lengths(msg, "input_topics", "input_stamps")
            stamps_ns = map(stamp_from_msg, msg.input_stamps)
            inputs = tuple(zip(msg.input_topics, stamps_ns, strict=True))
            content = StepDecided(inputs, msg.sqp_steps, msg.description)
        case EventKind.SET_FORMATION:
            content = FormationSet(formation_from_msgs(msg.formation, team))
        case EventKind.SET_PARAMETERS:
            check_lengths(msg, "parameter_names", "parameter_values")
            content = ParametersSet(dict(zip(msg.parameter_names, msg.parameter_values, strict=True)))
        case EventKind.FAULT:
            content = FaultReported(msg.description)
        case EventKind.ALARM:
            content = AlarmRaised(msg.description)
        case EventKind.REQUEST:
            content = RequestMade(_request(msg.description), tuple(msg.request_values))
        case EventKind.TAKE_OVER:
            content = TakenOver()
        case _:
            known = ", ".join(f"{kind.value} ({kind.name})" for kind in EventKind)
            raise RejectionError(Reason.INVALID, f"kind must be one of {known} (got {msg.kind})")
    return PerStep(msg.step, stamp_ns, Event(msg.source, content))


def _request(name: str) -> TeamRequest:
    try:
        return TeamRequest(name)
    except ValueError:
        known = ", ".join(request.value for request in TeamRequest)
        raise RejectionError(Reason.INVALID, f"request must be one of {known} (got '{name}')") from None


def formation_to_msgs(formation: Mapping[str, Vector3], team: TeamConfig) -> list[RelativePositionMsg]:
    """Position of each follower relative to the leader."""
    return [
        RelativePositionMsg(
            observer_id=team.leader, target_id=follower, position=vector_to_msg(np.array(formation[follower]))
        )
        for follower in team.followers
    ]


def formation_from_msgs(msgs: Iterable[RelativePositionMsg], team: TeamConfig) -> dict[str, Vector3]:
    """Position of each follower relative to the leader; whether the team can fly it is not checked.

    Raises:
        RejectionError: the observer is not the leader, a target is no follower or named twice, a follower is
            missing, or a position is not finite.
    """
    formation: dict[str, Vector3] = {}
    for msg in msgs:
        if msg.observer_id != team.leader:
            raise RejectionError(
                Reason.INVALID, f"observer_id must be the leader '{team.leader}' (got '{msg.observer_id}')"
            )
        if msg.target_id in formation:
            raise RejectionError(Reason.INVALID, f"target_id '{msg.target_id}' is named twice")
        if msg.target_id not in team.followers:
            known = ", ".join(team.followers)
            raise RejectionError(
                Reason.FOREIGN, f"target_id '{msg.target_id}' is no follower, expected one of {known}"
            )
        x, y, z = vector_from_msg(msg.position, f"position of '{msg.target_id}'").tolist()
        formation[msg.target_id] = (x, y, z)
    if missing := [follower for follower in team.followers if follower not in formation]:
        raise RejectionError(Reason.INVALID, f"formation has no position for '{missing[0]}'")
    return formation
