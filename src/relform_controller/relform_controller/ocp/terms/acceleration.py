"""The net acceleration of each vehicle, zero at hover (the force term of eq. CostFunc1, divided by mass)."""

from relform_controller.ocp.terms.term import VehicleTerm

ACCELERATION = VehicleTerm(
    "acceleration",
    residual=lambda _, stage: stage.acceleration,
    weight=lambda _, weights: weights.acceleration,
)
