"""Keys that are pressed in a terminal, without waiting for Enter."""

import os
import select
import sys
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager

KEYS = {b" ": "space", b"\x1b[A": "up", b"\x1b[B": "down", b"\x1b[C": "right"}


class Keyboard:
    """Reads keys from a file descriptor; None: there is no terminal, so there are no keys."""

    def __init__(self, descriptor: int | None) -> None:
        self._descriptor = descriptor

    def pressed(self) -> str | None:
        """Name of a key that was pressed since the last call, if any that is known."""
        if self._descriptor is None or not select.select([self._descriptor], [], [], 0.0)[0]:
            return None
        return KEYS.get(os.read(self._descriptor, 8))


@contextmanager
def terminal_keyboard() -> Iterator[Keyboard]:
    """The keyboard of this terminal, whose settings are restored afterwards."""
    if not sys.stdin.isatty():
        yield Keyboard(None)
        return
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    try:
        tty.setcbreak(descriptor)
        yield Keyboard(descriptor)
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)
