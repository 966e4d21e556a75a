"""What a node reports about itself on /diagnostics."""

from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from relform_core.units import NANOSECONDS_PER_SECOND
from relform_ros.fields import header_to_msg
from relform_ros.rejection import Reason, Rejections


def is_due(step: int, period_ns: int) -> bool:
    """Whether nodes publish their diagnostics in a step: once per second of simulation time at most."""
    return step % max(1, round(NANOSECONDS_PER_SECOND / period_ns)) == 0


def diagnostics_to_msg(
    stamp_ns: int, node: str, rejections: Rejections, values: Mapping[str, object]
) -> DiagnosticArray:
    """Number of rejected messages by reason, and the node's own values; a warning if any was rejected."""
    counts = {f"rejected.{reason}": rejections[reason] for reason in Reason}
    warned = rejections.total > 0
    status = DiagnosticStatus(
        level=DiagnosticStatus.WARN if warned else DiagnosticStatus.OK,
        name=node,
        message=f"rejected {rejections.total} messages, the last: {rejections.last}" if warned else "",
        values=[KeyValue(key=key, value=str(value)) for key, value in (counts | dict(values)).items()],
    )
    return DiagnosticArray(header=header_to_msg(stamp_ns), status=[status])
