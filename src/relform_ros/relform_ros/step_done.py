"""The end of a step, as a member of the barrier reports it, to a message and back.

As in ``fields``, ``*_to_msg`` trusts its argument, ``*_from_msg`` raises ``RejectionError``.
"""

from relform_msgs.msg import StepDone as StepDoneMsg
from relform_ros.fields import check_lengths, header_to_msg
from relform_ros.lockstep import JOINED, Done
from relform_ros.rejection import Reason, RejectionError


def done_to_msg(done: Done, stamp_ns: int) -> StepDoneMsg:
    """What a member says when it has finished a step, at the instant of the step."""
    return StepDoneMsg(
        header=header_to_msg(stamp_ns),
        step=done.step,
        node=done.node,
        sent=[topic for topic, _ in done.sent],
        sent_stamps=[stamp_ns for _, stamp_ns in done.sent],
        fault=done.fault,
        configuration=done.configuration,
        process=done.process,
        rests=done.rests,
    )


def done_from_msg(msg: StepDoneMsg, node: str) -> Done:
    """What the member ``node`` says when it has finished a step.

    Raises:
        RejectionError: another node says so, or no possible step.
    """
    if msg.node != node:
        raise RejectionError(Reason.FOREIGN, f"node must be '{node}' (got '{msg.node}')")
    if msg.step < JOINED:
        raise RejectionError(Reason.INVALID, f"step must be at least {JOINED} (got {msg.step})")
    check_lengths(msg, "sent", "sent_stamps")
    return Done(
        node=msg.node,
        step=msg.step,
        sent=tuple(zip(msg.sent, msg.sent_stamps, strict=True)),
        fault=msg.fault,
        configuration=msg.configuration,
        process=msg.process,
        rests=msg.rests,
    )
