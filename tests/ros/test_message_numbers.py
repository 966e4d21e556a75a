"""The numbers of the enums in relform_core are those of the message definitions."""

from enum import IntEnum
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticStatus

from relform_core.flight_modes import Request, TeamMode, VehicleMode
from relform_core.health import Level
from relform_core.names import EstimatorMode, EventKind, SeparationLevel, SolverState
from relform_msgs.msg import (
    FlightStatus,
    FormationEvent,
    FormationState,
    RotorSpeeds,
    Separation,
    SolverStatus,
    TeamStatus,
)


@pytest.mark.parametrize(
    ("enum", "message"),
    [
        (EventKind, FormationEvent),
        (SolverState, SolverStatus),
        (EstimatorMode, FormationState),
        (Request, RotorSpeeds),
        (VehicleMode, FlightStatus),
        (TeamMode, TeamStatus),
        (SeparationLevel, Separation),
    ],
)
def test_enum_has_the_constants_of_its_message(enum: type[IntEnum], message: Any) -> None:
    metaclass = type(message)
    constants = vars(metaclass)[f"_{metaclass.__name__}__constants"]
    assert {member.name: member.value for member in enum} == constants


def test_levels_are_those_of_diagnostics() -> None:
    levels = {level.name: bytes([level]) for level in Level}
    assert levels == {name: getattr(DiagnosticStatus, name) for name in ("OK", "WARN", "ERROR", "STALE")}
