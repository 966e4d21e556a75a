"""A flight of a benchmark: flown once, and nothing of it is kept."""

import tempfile
from collections.abc import Callable, Mapping
from datetime import datetime
from pathlib import Path

from rich.console import Console

from relform_bringup.create_folder import create_run_folder
from relform_bringup.flight import Flight, FlownFlight
from relform_bringup.interruption import interruption_noted
from relform_core.load import LoadedScenario
from relform_core.ros_domain import claimed_domain


def fly_once(
    scenario: LoadedScenario,
    console: Console,
    *,
    record: bool = True,
    composed: bool = False,
    on_step: Callable[[int, Mapping[str, int]], None] | None = None,
    note_bag: Callable[[Path], None] = lambda bag: None,
) -> FlownFlight:
    """Fly in a temporary folder; arguments as of ``Flight``, and ``note_bag`` gets the folder of the bag."""
    with (
        interruption_noted() as interruption,
        claimed_domain() as domain,
        tempfile.TemporaryDirectory() as at,
    ):
        folder = create_run_folder(scenario, Path(at) / "flight", datetime.now())
        note_bag(folder.bag)
        return Flight(scenario, folder, record, composed, domain, interruption, on_step).fly(console)
