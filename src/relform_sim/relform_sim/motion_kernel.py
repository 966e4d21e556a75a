"""The motion of a vehicle in C (``motion.c``), equal bit for bit to the reference."""

import ctypes
import math
from functools import cache
from importlib import resources

from relform_core.c_library import NoCompilerError, shared_library
from relform_core.units import GRAVITY
from relform_sim.contact import FRICTION
from relform_sim.integrate import State
from relform_sim.motion import Inputs, Motion, ReferenceMotion
from relform_sim.rigid_body import Body

FLAGS = ("-O2", "-ffp-contract=off", "-fno-math-errno", "-fPIC", "-shared")
"""Without fused operations, which round once where Python rounds twice; nor any for one processor only."""


def make_motion(body: Body, step: float, rotor_time_constant: float) -> Motion:
    """The compiled motion, or the reference where there is no C compiler.

    Args:
        body: the true vehicle.
        step: of the integration by RK4 [s].
        rotor_time_constant: first-order lag of the rotor speeds [s]; 0: none.
    Raises:
        RelformError: the compiler fails, or its result cannot be kept.
    """
    try:
        return CompiledMotion(body, step, rotor_time_constant)
    except NoCompilerError:
        return ReferenceMotion(body, step, rotor_time_constant)


class _Vehicle(ctypes.Structure):
    """The same as ``Vehicle`` in motion.c."""

    _fields_ = (
        ("mass", ctypes.c_double),
        ("inertia", ctypes.c_double * 3),
        ("arm_length", ctypes.c_double),
        ("thrust_coefficient", ctypes.c_double),
        ("torque_coefficient", ctypes.c_double),
        ("drag_coefficient", ctypes.c_double * 3),
        ("spread", ctypes.c_double),
        ("length", ctypes.c_double),
        ("stiffness", ctypes.c_double),
        ("damping", ctypes.c_double),
        ("grip", ctypes.c_double),
        ("reach", ctypes.c_double),
        ("step", ctypes.c_double),
        ("rotor_time_constant", ctypes.c_double),
        ("rotor_speeds", ctypes.c_double * 4),
        ("commanded", ctypes.c_double * 4),
        ("wind_N", ctypes.c_double * 3),
        ("thrust_scale", ctypes.c_double),
        ("rotor_scales", ctypes.c_double * 4),
        ("state", ctypes.c_double * 13),
    )


class CompiledMotion:
    """The motion in C (``Motion``).

    Args:
        body: the true vehicle.
        step: of the integration by RK4 [s].
        rotor_time_constant: first-order lag of the rotor speeds [s]; 0: none.
    Raises:
        NoCompilerError: there is no C compiler.
        RelformError: the compiler fails, or its result cannot be kept.
    """

    def __init__(self, body: Body, step: float, rotor_time_constant: float) -> None:
        self._advance = _library().advance
        self._vehicle = _Vehicle(
            mass=body.mass,
            inertia=body.inertia,
            arm_length=body.arm_length,
            thrust_coefficient=body.thrust_coefficient,
            torque_coefficient=body.torque_coefficient,
            drag_coefficient=body.drag_coefficient,
            reach=-math.inf,
            step=step,
            rotor_time_constant=rotor_time_constant,
        )
        if (legs := body.legs) is not None:
            for name in ("spread", "length", "stiffness", "damping", "grip", "reach"):
                setattr(self._vehicle, name, getattr(legs, name))

    def after(self, n_steps: int, state: State, inputs: Inputs) -> State:
        """See ``Motion``."""
        vehicle = self._vehicle
        vehicle.state[:] = state
        vehicle.rotor_speeds[:] = inputs.rotor_speeds
        vehicle.commanded[:] = inputs.commanded
        vehicle.wind_N[:] = inputs.wind_N
        vehicle.thrust_scale = inputs.thrust_scale
        vehicle.rotor_scales[:] = inputs.rotor_scales
        self._advance(ctypes.byref(vehicle), n_steps)
        return tuple(vehicle.state)


@cache
def _library() -> ctypes.CDLL:
    """The library, with typed functions."""
    text = resources.files(__package__).joinpath("motion.c").read_text()
    constants = f"#define GRAVITY {GRAVITY!r}\n#define FRICTION {FRICTION!r}\n"
    library = ctypes.CDLL(str(shared_library(constants + text, FLAGS)))
    library.advance.argtypes = [ctypes.c_void_p, ctypes.c_long]
    library.advance.restype = None
    return library
