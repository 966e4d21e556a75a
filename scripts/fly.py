#!/usr/bin/env python3
"""Fly a scenario with real nodes, one process each, recorded and scored. `--help` says more."""

import sys

from relform_tools.bringup_command import main

if __name__ == "__main__":
    sys.exit(main())
