"""A clock of the machine that jumps, and a slow disk, for chosen processes only (``shim.c``)."""

import struct
from pathlib import Path

from relform_core.c_library import shared_library

FLAGS = ("-O1", "-Wall", "-Werror", "-fPIC", "-shared")
UNITS = 1e9
SIZE = 16


class Shim:
    """What processes that are started by ``command`` see of the machine.

    Args:
        control: a file that does not exist; it holds what is changed in flight.
    Raises:
        RelformError: there is no compiler.
    """

    def __init__(self, control: Path) -> None:
        self._control = control
        self._library = shared_library((Path(__file__).parent / "shim.c").read_text(encoding="utf-8"), FLAGS)
        control.write_bytes(bytes(SIZE))

    @property
    def command(self) -> tuple[str, ...]:
        """What to put before the command of a process."""
        return ("env", f"LD_PRELOAD={self._library}", f"RELFORM_FAULTS={self._control}")

    def jump(self, time: float) -> None:
        """Set the clock of the machine off by a time from now on [s]."""
        self._set(0, time)

    def slow_down(self, time: float) -> None:
        """Let every write to a file take a time from now on [s]."""
        self._set(8, time)

    def _set(self, offset: int, time: float) -> None:
        with self._control.open("r+b") as file:
            file.seek(offset)
            file.write(struct.pack("=q", round(time * UNITS)))
