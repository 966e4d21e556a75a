"""Schema of ``config/vehicles/*.yaml``: one quadrotor type."""

import math
from typing import Annotated, Self

from pydantic import AfterValidator, Field, model_validator

from relform_core.schema import Label, NonNegative, NonNegativeVector3, Positive, PositiveVector3, Schema
from relform_core.units import DEGREES, GRAVITY, PERCENT, RPM, rad_s_to_rpm

_PERCENT_OR_NONE = AfterValidator(lambda percent: None if percent is None else percent / 100.0)
Tilt = Annotated[float, Field(gt=0.0, le=180.0), DEGREES]


class FailsafeConfig(Schema):
    """What a vehicle flies when no commands arrive."""

    plan_max: Annotated[float, Field(alias="plan_max_s", ge=0.0, le=10.0, examples=[1.0])]
    """Longest time for which the plan of the last command is flown; then the vehicle levels out and sinks."""
    descent_speed: Annotated[float, Field(alias="descent_speed_m_s", gt=0.0, le=3.0, examples=[0.3])]
    """Vertical speed of a vehicle without a plan, downwards."""


class VehicleConfig(Schema):
    """A quadrotor with rotors front, left, back, right (eq. Aerodynamics in the FLU body frame)."""

    name: Annotated[Label, Field(examples=["AscTec Hummingbird class"])]
    """Name of the type, for people to read."""
    mass: Annotated[float, Field(alias="mass_kg", gt=0.0, examples=[0.716])]
    """Nominal mass. The controller uses it."""
    inertia: Annotated[PositiveVector3, Field(alias="inertia_kg_m2", examples=[[0.007, 0.007, 0.012]])]
    """Nominal principal moments of inertia about body x, y, z."""
    arm_length: Annotated[float, Field(alias="arm_length_m", gt=0.0, examples=[0.18])]
    """Distance of each rotor's axis from the centre of mass."""
    thrust_coefficient: Annotated[
        float, Field(alias="thrust_coefficient_n_s2", gt=0.0, examples=[8.54858e-6])
    ]
    """c_T in thrust = c_T * speed^2 of a rotor, speed in rad/s."""
    torque_coefficient: Annotated[
        float, Field(alias="torque_coefficient_nm_s2", gt=0.0, examples=[1.3678e-7])
    ]
    """c_Q in drag torque = c_Q * speed^2 of a rotor, speed in rad/s."""
    rotor_speed_min: Annotated[float, Field(alias="rotor_speed_min_rpm", ge=0.0, examples=[1200.0]), RPM]
    """Lowest speed of a rotor in flight; below the speed at which the vehicle hovers."""
    rotor_speed_max: Annotated[float, Field(alias="rotor_speed_max_rpm", gt=0.0, examples=[6000.0]), RPM]
    """Highest speed of a rotor; above the speed at which the vehicle hovers."""
    rotor_time_constant: Annotated[NonNegative, Field(alias="rotor_time_constant_s", examples=[0.05])]
    """Time constant of the first-order lag of the rotors; 0: none. The controller knows it."""
    drag_coefficient: Annotated[
        NonNegativeVector3, Field(alias="drag_coefficient_n_s_m", examples=[[0.1, 0.1, 0.05]])
    ]
    """Linear drag along body x, y, z; 0: none. The controller knows it."""
    mass_std: Annotated[float, Field(alias="mass_std_percent", ge=0.0, lt=20.0, examples=[1.0]), PERCENT]
    """Relative standard deviation of the true mass, drawn for each flight; the controller keeps the nominal
    one."""
    inertia_std: Annotated[
        float, Field(alias="inertia_std_percent", ge=0.0, lt=20.0, examples=[5.0]), PERCENT
    ]
    """The same for each true moment of inertia."""
    collision_radius: Annotated[Positive, Field(alias="collision_radius_m", examples=[0.25])]
    """Two vehicles collide when their centres are closer than the sum of their radii."""
    leg_height: Annotated[Positive, Field(alias="leg_height_m")] = 0.1
    """Height of the body origin of a vehicle that stands on the ground, on legs below its rotors."""
    tilt_max: Annotated[Tilt, Field(alias="tilt_max_deg", examples=[85.0])]
    """A tilt beyond this is a fault, which ends the flight."""
    failsafe: FailsafeConfig
    """What the vehicle flies when no commands arrive."""
    thrust_min: Annotated[
        float | None, Field(alias="thrust_min_percent", gt=0.0, lt=100.0, examples=[62.0]), _PERCENT_OR_NONE
    ] = None
    """A vehicle that measures for two seconds that its rotors give less than this part of their nominal
    thrust ends its flight: it sinks on its own sensors, and takes no more commands; null: it flies on. More
    than the part with which it can just hover."""

    @property
    def separation_min(self) -> float:
        """Two vehicles collide when their centres are closer than this [m]."""
        return 2.0 * self.collision_radius

    @property
    def hover_speed(self) -> float:
        """Rotor speed at which four rotors carry the nominal weight [rad/s]."""
        return math.sqrt(self.hover_thrust / self.thrust_coefficient)

    @property
    def hover_thrust(self) -> float:
        """Thrust of one rotor at which four rotors carry the nominal weight [N]."""
        return self.mass * GRAVITY / 4.0

    @property
    def hover_share(self) -> float:
        """Part of the nominal thrust at full speed with which the vehicle can just hover."""
        return (self.hover_speed / self.rotor_speed_max) ** 2

    @model_validator(mode="after")
    def _lands_in_time(self) -> Self:
        if self.thrust_min is not None and self.thrust_min <= self.hover_share:
            raise ValueError(
                f"thrust_min_percent {100.0 * self.thrust_min:g} must be more than "
                f"{100.0 * self.hover_share:.1f}, with which the vehicle can just hover"
            )
        return self

    @model_validator(mode="after")
    def _can_hover(self) -> Self:
        if not self.rotor_speed_min < self.hover_speed < self.rotor_speed_max:
            hover, lowest, highest = map(
                rad_s_to_rpm, (self.hover_speed, self.rotor_speed_min, self.rotor_speed_max)
            )
            raise ValueError(
                f"cannot hover: the rotors carry the weight at {hover:.0f} rpm, which is not within "
                f"rotor_speed_min_rpm {lowest:.0f} ... rotor_speed_max_rpm {highest:.0f}"
            )
        return self
