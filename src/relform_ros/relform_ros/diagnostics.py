"""What a node reports about itself on /diagnostics."""

from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from relform_core.health import Health
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_ros.fields import header_to_msg
from relform_ros.rejection import Reason, Rejections


def is_due(step: int, period_ns: int) -> bool:
    """Whether nodes publish their diagnostics in a step: once per second of simulation time at most."""
    return step % max(1, round(NANOSECONDS_PER_SECOND / period_ns)) == 0


class Diagnostics:
    """The reports of one node."""

    def __init__(self, node: str, rejections: Rejections) -> None:
        self._node = node
        self._rejections = rejections
        self._health = Health()

    def report(self, stamp_ns: int, values: Mapping[str, object]) -> DiagnosticArray:
        """The next report: rejected messages by reason, the node's own values, and its level."""
        rejections = self._rejections
        level, message = self._health.judge(values, rejections.total, rejections.last)
        counts = {f"rejected.{reason}": rejections[reason] for reason in Reason}
        status = DiagnosticStatus(
            level=bytes([level]),
            name=self._node,
            message=message,
            values=[KeyValue(key=key, value=str(value)) for key, value in (counts | dict(values)).items()],
        )
        return DiagnosticArray(header=header_to_msg(stamp_ns), status=[status])
