"""How the scripts end, whatever their commands do."""

import os
import sys
from collections.abc import Callable

EXIT_UNREAD = 1
EXIT_INTERRUPTED = 130


def run_script(main: Callable[[], int]) -> int:
    """Run a command; returns its exit code, 1 if nobody reads its output to the end, 130 after Ctrl-C."""
    try:
        code = main()
        sys.stdout.flush()
    except BrokenPipeError:  # the reader, such as head, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_UNREAD
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED
    return code
