"""Exit codes of commands and of nodes."""

from enum import IntEnum

EXIT_FAILURE = 1
"""A command did its work, and the result is a failure; or nothing reads its output to the end."""
EXIT_USAGE = 2
"""A command cannot be carried out: wrong usage, or an input or output that it cannot use."""
EXIT_FAULT = 3
"""``fly``: a vehicle reported a fault."""
EXIT_INTERRUPTED = 130
"""A command was interrupted; the code of a shell after Ctrl-C."""


class NodeExit(IntEnum):
    """How a node of a flight ends."""

    FLIGHT_OVER = 0
    """It has seen the last step of the flight."""
    ERROR = 1
    """It cannot continue; the last line that it printed is the reason."""
    SILENT_MEMBER = 2
    """The clock: a member of the barrier was silent for too long; the last line names it."""
    MEMBER_FAULT = 3
    """The clock: a member of the barrier reported a fault; the last line is its report."""
    INTERRUPTED = EXIT_INTERRUPTED
