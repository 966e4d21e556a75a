"""Run the main function of a command, or report in one line which Python can run it."""

import os
import sys
from importlib import import_module
from pathlib import Path
from typing import NoReturn

ENVIRONMENT = Path(__file__).resolve().parent.parent / ".venv"
EXIT_USAGE, EXIT_INTERRUPTED = 2, 130


def run_main(module: str) -> NoReturn:
    """Exit with the exit code that ``main`` of the module returns."""
    try:
        main = import_module(module).main
    except ImportError as error:
        if Path(sys.prefix) == ENVIRONMENT:
            raise
        python = os.path.relpath(ENVIRONMENT / "bin/python")
        print(
            f"error: this Python ({sys.executable}) has no {error.name}: "
            f"run make setup once, then {' '.join([python, *sys.argv])}",
            file=sys.stderr,
        )
        sys.exit(EXIT_USAGE)
    except KeyboardInterrupt:
        sys.exit(EXIT_INTERRUPTED)
    sys.exit(main())
