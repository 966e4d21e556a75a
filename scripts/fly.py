#!/usr/bin/env python3
"""Fly a scenario with real nodes, one process each, recorded and scored. `--help` says more."""

import sys

EXIT_INTERRUPTED = 130

if __name__ == "__main__":
    try:
        from relform_bringup.command import main  # takes a while

        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(EXIT_INTERRUPTED)
