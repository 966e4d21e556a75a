#!/usr/bin/env python3
"""Copy a recorded flight into a bag that Foxglove draws in 3D as well. `--help` says more."""

import sys

from relform_bags.foxglove.command import main
from relform_core.script import run_script

if __name__ == "__main__":
    sys.exit(run_script(main))
