"""The pacing that a scenario asks for."""

from rclpy.node import Node

from relform_core.load import LoadedScenario
from relform_core.roster import Roster
from relform_ros.lockstep_pacing import LockstepPacing
from relform_ros.pacing import Pacing
from relform_ros.real_time_pacing import RealTimePacing
from relform_ros.spinner import Spinner


def make_pacing(node: Node, spinner: Spinner, scenario: LoadedScenario, roster: Roster) -> Pacing:
    """The pacing of one node of a flight.

    Raises:
        ConfigError: the node is no member of the flight.
    """
    if (real_time := scenario.config.real_time) is not None:
        return RealTimePacing(node, spinner, scenario, roster, real_time)
    return LockstepPacing(node, spinner, scenario, roster)
