"""Show the progress of a flight: one live line on a terminal, otherwise a line every few seconds."""

import time
from types import TracebackType
from typing import Protocol, Self

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table

from relform_core.flight_modes import TeamMode
from relform_core.phases_config import PhaseConfig
from relform_core.scenario_config import ScenarioConfig

REFRESH_S = 0.1
PLAIN_REFRESH_S = 3.0
BAR_WIDTH = 24


class FlightProgress(Protocol):
    """What is shown of a running flight."""

    @property
    def step(self) -> int:
        """The newest control step that is complete."""

    @property
    def flown(self) -> float:
        """Simulation time [s]."""

    @property
    def wall_time(self) -> float:
        """Since the first step [s]."""

    @property
    def fallbacks(self) -> int:
        """Number of control steps whose SQP step failed."""

    def formation_error(self) -> float | None:
        """Mean true formation error of the scored pairs in the newest step [m]; None: unknown."""

    def waiting_for(self) -> str:
        """What the controller waits for before its first command; empty: it does not wait."""

    def team_mode(self) -> TeamMode | None:
        """What the team does between ground and air; None: it starts airborne, or nothing was seen."""


class FlightDisplay:
    """Shows the state of a flight; a context manager."""

    def __init__(self, console: Console, config: ScenarioConfig) -> None:
        self._console = console
        self._duration = config.n_steps * config.controller.period
        self._config = config
        self._phase_width = max(len(_shown(phase)) for phase in config.phases)
        self._live = Live(console=console, auto_refresh=False, transient=True)
        self._refresh_s = REFRESH_S if console.is_terminal else PLAIN_REFRESH_S
        self._refreshed = time.monotonic() - self._refresh_s

    def __enter__(self) -> Self:
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.stop()

    def message(self, text: str) -> None:
        """Show a text before the flight."""
        if self._console.is_terminal:
            self._live.update(text, refresh=True)
        else:
            self._console.print(text)

    def note(self, text: str) -> None:
        """Print a line that stays, during the flight."""
        self._live.console.print(text, highlight=False)

    def show(self, flight: FlightProgress) -> None:
        """Show the newest step, at most once per refresh period."""
        if time.monotonic() - self._refreshed < self._refresh_s:
            return
        self._refreshed = time.monotonic()
        mode = flight.team_mode()
        phase = _shown(self._config.phase_at(flight.step)) if self._config.ground is None else str(mode or "")
        times = f"{flight.flown:5.2f} / {self._duration:.1f} s"
        error = flight.formation_error()
        facts = [f"formation error {error:.3f} m"] if error is not None else []
        if error is None and (missing := flight.waiting_for()):
            facts.append(f"waits for {missing}")
        if flight.fallbacks:
            facts.append(f"{flight.fallbacks} {'fallback' if flight.fallbacks == 1 else 'fallbacks'}")
        if flight.wall_time > 0.0:
            facts.append(f"{flight.flown / flight.wall_time:.1f} x real time")
        if not self._console.is_terminal:
            self._console.print("   ".join([f"{phase:{self._phase_width}}", times, *facts]))
            return
        line = Table.grid(padding=(0, 3, 0, 0))
        bar = ProgressBar(total=self._duration, completed=flight.flown, width=BAR_WIDTH)
        line.add_row(f"{phase:{self._phase_width}}", bar, times, *facts)
        self._live.update(line, refresh=True)


def _shown(phase: PhaseConfig) -> str:
    return f"{phase.name} {phase.title}"
