"""How far apart the vehicles of a team are, as a message."""

from relform_core.telemetry import PerStep, SeparationReport
from relform_msgs.msg import Separation as SeparationMsg
from relform_ros.fields import header_to_msg


def separation_to_msg(report: PerStep[SeparationReport]) -> SeparationMsg:
    """How far apart the vehicles are in one control step."""
    separation = report.value
    msg = SeparationMsg(
        header=header_to_msg(report.stamp_ns),
        step=report.step,
        level=int(separation.level),
        nearest=list(separation.estimated.vehicles),
        distance=separation.estimated.distance,
        nearest_predicted=list(separation.predicted.vehicles),
        predicted_distance=separation.predicted.distance,
        predicted_in=separation.predicted_in,
    )
    if separation.measured is not None:
        msg.nearest_measured = list(separation.measured.vehicles)
        msg.measured_distance = separation.measured.distance
    return msg
