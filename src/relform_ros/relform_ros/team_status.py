"""What a team does between the ground and the air, to messages and back.

As in ``fields``, ``*_to_msg`` trusts its argument, ``*_from_msg`` raises ``RejectionError``.
"""

from relform_core.flight_modes import TeamMode, VehicleMode
from relform_core.telemetry import PerStep, TeamStatus
from relform_msgs.msg import TeamStatus as TeamStatusMsg
from relform_ros.fields import check_lengths, header_from_msg, header_to_msg, number_from_msg


def status_to_msg(status: PerStep[TeamStatus]) -> TeamStatusMsg:
    """What a team does in one control step."""
    team = status.value
    return TeamStatusMsg(
        header=header_to_msg(status.stamp_ns),
        step=status.step,
        mode=team.mode,
        reason=team.reason,
        refused=team.refused,
        vehicles=list(team.vehicle_modes),
        vehicle_modes=list(team.vehicle_modes.values()),
    )


def status_from_msg(msg: TeamStatusMsg) -> PerStep[TeamStatus]:
    """What a team does in one control step.

    Raises:
        RejectionError: see the module; also an unknown mode, or lists that differ in length.
    """
    stamp_ns = header_from_msg(msg.header, "")
    check_lengths(msg, "vehicles", "vehicle_modes")
    modes = {
        vehicle: number_from_msg(VehicleMode, mode, "vehicle_modes")
        for vehicle, mode in zip(msg.vehicles, msg.vehicle_modes, strict=True)
    }
    status = TeamStatus(number_from_msg(TeamMode, msg.mode, "mode"), msg.reason, msg.refused, modes)
    return PerStep(msg.step, stamp_ns, status)
