"""The rotor speeds that a vehicle has flown. Its onboard logic reports them beside the sensors.

They acknowledge the commands: when one is lost or late, the vehicle flies a plan or its failsafe.
"""

from dataclasses import dataclass

from relform_core.arrays import Array
from relform_core.sensors.sensor import Source

ACKNOWLEDGED_INTERVALS = 20
"""How many intervals each report covers, so that the next report makes up for lost ones."""


@dataclass(frozen=True, eq=False)
class AppliedRotorSpeeds:
    """relform_msgs/AppliedRotorSpeeds: what was flown until an instant."""

    stamp_ns: int
    """End of the last interval."""
    period_ns: int
    """Length of each interval."""
    speeds: Array
    """By interval, the oldest first; rotors front, left, back, right [rad/s], shape (interval, 4)."""

    command_stamp_ns: int | None
    """Stamp of the command whose plan was flown in the last interval; None: none was."""

    @property
    def starts_ns(self) -> range:
        """Starts of the intervals."""
        return range(self.stamp_ns - len(self.speeds) * self.period_ns, self.stamp_ns, self.period_ns)


APPLIED_ROTOR_SPEEDS = Source("applied_rotor_speeds", AppliedRotorSpeeds)
