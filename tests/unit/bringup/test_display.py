"""What a user sees of a running flight."""

from dataclasses import dataclass
from io import StringIO

import pytest
from rich.console import Console

from relform_bringup.display import FlightDisplay
from relform_core.flight_modes import TeamMode
from support.scenarios import paper_scenario


@dataclass
class Progress:
    """A moment of a flight."""

    step: int = 99
    flown: float = 5.0
    wall_time: float = 0.5
    fallbacks: int = 0
    error: float | None = 0.0625
    missing: str = ""
    mode: TeamMode | None = None

    def formation_error(self) -> float | None:
        return self.error

    def waiting_for(self) -> str:
        return self.missing

    def team_mode(self) -> TeamMode | None:
        return self.mode


def shown(progress: Progress, *overrides: str, terminal: bool = False) -> str:
    """The line without the spaces that align it."""
    output = StringIO()
    console = Console(file=output, width=200, force_terminal=terminal, color_system=None)
    with FlightDisplay(console, paper_scenario(*overrides).config) as display:
        display.show(progress)
    return " ".join(output.getvalue().split())


ERROR = "formation error 0.062 m"


@pytest.mark.parametrize(
    ("progress", "line"),
    [
        (Progress(), f"B straight line 5.00 / 27.0 s {ERROR} 10.0 x real time"),
        (Progress(fallbacks=1), f"B straight line 5.00 / 27.0 s {ERROR} 1 fallback 10.0 x real time"),
        (Progress(fallbacks=3), f"B straight line 5.00 / 27.0 s {ERROR} 3 fallbacks 10.0 x real time"),
        (
            Progress(0, 0.0, 0.0, error=None, missing="/leader/imu"),
            "A static formation 0.00 / 27.0 s waits for /leader/imu",
        ),
    ],
)
def test_line_without_a_terminal(progress: Progress, line: str) -> None:
    assert shown(progress) == line


def test_with_take_off_and_landing_the_mode_is_shown() -> None:
    progress = Progress(mode=TeamMode.TAKING_OFF, error=None, missing="the vehicles")
    line = shown(progress, "ground={time_s: 40}")
    assert line == "taking off 5.00 / 40.0 s waits for the vehicles 10.0 x real time"


def test_live_line_on_a_terminal_counts_fallbacks() -> None:
    assert "3 fallbacks" in shown(Progress(fallbacks=3), terminal=True)
    assert "fallback" not in shown(Progress(), terminal=True)
