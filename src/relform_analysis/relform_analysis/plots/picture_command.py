"""The command that draws one picture of the documentation into a file."""

from collections.abc import Callable, Sequence
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from relform_analysis.plots.style import COMMON
from relform_core.script import CommandParser


def draw_into_file(
    name: str, description: str, picture: Callable[[], Figure], arguments: Sequence[str] | None
) -> int:
    """Draw the picture, print its file, return the exit code.

    Args:
        name: of the command, and of the file unless --out names another.
        description: of the command, for its help.
        picture: draws.
        arguments: of the command line; None: those of the process.
    """
    default = Path(f"{name}.png")
    parser = CommandParser(prog=name, description=description)
    parser.add_argument("--out", type=Path, default=default, help=f"file of the picture (default {default})")
    options = parser.parse_args(arguments)
    with matplotlib.rc_context(COMMON | {"font.size": 8.0}):
        picture().savefig(options.out, dpi=130)
    print(options.out)
    return 0
