"""Read single keys from a terminal, without waiting for Enter."""

import os
import select
import sys
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager

KEYS = {b" ": "space", b"\x1b[A": "up", b"\x1b[B": "down", b"\x1b[C": "right"}


class Keyboard:
    """Reads keys from a file descriptor; None: no terminal is connected, so no key is ever pressed."""

    def __init__(self, descriptor: int | None) -> None:
        self._descriptor = descriptor
        self._unread = b""

    @property
    def is_connected(self) -> bool:
        """Whether keys can be pressed."""
        return self._descriptor is not None

    def pressed(self) -> str | None:
        """Name of the next known key that was pressed; None: no key."""
        if self._descriptor is None:
            return None
        if select.select([self._descriptor], [], [], 0.0)[0]:
            self._unread += os.read(self._descriptor, 64)
        while self._unread:
            for code, name in KEYS.items():
                if self._unread.startswith(code):
                    self._unread = self._unread.removeprefix(code)
                    return name
            self._unread = self._unread[1:]
        return None


@contextmanager
def terminal_keyboard(wanted: bool = True) -> Iterator[Keyboard]:
    """The keyboard of this terminal; the settings of the terminal are restored afterwards."""
    if not wanted or not sys.stdin.isatty():
        yield Keyboard(None)
        return
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    try:
        tty.setcbreak(descriptor)
        yield Keyboard(descriptor)
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)
