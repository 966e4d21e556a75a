"""The terms of the cost: eqs. CostFunc1 and CostFunc2, and the thrust rate."""

from relform_controller.ocp.terms.acceleration import ACCELERATION
from relform_controller.ocp.terms.formation import FORMATION
from relform_controller.ocp.terms.leader_position import LEADER_POSITION
from relform_controller.ocp.terms.leader_yaw import LEADER_YAW
from relform_controller.ocp.terms.term import Terms
from relform_controller.ocp.terms.thrust_rate import THRUST_RATE
from relform_controller.ocp.terms.torque import TORQUE

TERMS = Terms(
    vehicle=(ACCELERATION, TORQUE, THRUST_RATE),
    leader=(LEADER_POSITION, LEADER_YAW),
    pair=(FORMATION,),
)
