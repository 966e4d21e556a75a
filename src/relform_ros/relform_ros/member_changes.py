"""The clock's decisions on nodes of a running flight to messages and back.

As in ``fields``, ``*_to_msg`` trusts its argument, ``*_from_msg`` raises ``RejectionError``.
"""

from relform_msgs.msg import MemberChange as MemberChangeMsg
from relform_ros.fields import header_to_msg
from relform_ros.membership import MemberChange, Verdict
from relform_ros.rejection import Reason, RejectionError


def change_to_msg(change: MemberChange, stamp_ns: int) -> MemberChangeMsg:
    """A decision, made at an instant of the flight."""
    return MemberChangeMsg(
        header=header_to_msg(stamp_ns),
        step=change.step,
        kind=change.verdict.value,
        node=change.node,
        process=change.process,
        reason=change.reason,
    )


def change_from_msg(msg: MemberChangeMsg) -> MemberChange:
    """A decision.

    Raises:
        RejectionError: of an unknown kind.
    """
    try:
        verdict = Verdict(msg.kind)
    except ValueError:
        known = ", ".join(f"{each.value} ({each.name})" for each in Verdict)
        raise RejectionError(Reason.INVALID, f"kind must be one of {known} (got {msg.kind})") from None
    return MemberChange(msg.step, verdict, msg.node, msg.process, msg.reason)
