"""Wake a waiting node when the clock of the machine was set back.

The executor of the wheels waits until a time of that clock: set back by a minute, a wait of 0.1 s takes a
minute, unless a message comes.
"""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

LOOK_EVERY_S = 0.2
"""How late a jump is noticed at most."""
JUMP_S = 0.05
"""The clock was set if it has lost more than this against the steady clock."""


@contextmanager
def woken_after_jumps(wake: Callable[[], None]) -> Iterator[None]:
    """Within the block, call ``wake`` from another thread after the clock of the machine was set back."""
    ended = False

    def look() -> None:
        ahead = time.time() - time.monotonic()
        while not ended:
            time.sleep(LOOK_EVERY_S)
            before, ahead = ahead, time.time() - time.monotonic()
            if ahead < before - JUMP_S:
                wake()

    threading.Thread(target=look, daemon=True).start()
    try:
        yield
    finally:
        ended = True
