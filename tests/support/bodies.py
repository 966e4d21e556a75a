"""A quadrotor whose parameters are those of no configuration."""

from relform_sim.rigid_body import Body

BODY = Body(
    mass=0.72,
    inertia=(0.006, 0.008, 0.013),
    arm_length=0.18,
    thrust_coefficient=8.5e-6,
    torque_coefficient=1.4e-7,
    drag_coefficient=(0.0, 0.0, 0.0),
)
