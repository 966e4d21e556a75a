#!/usr/bin/env python3
"""Play a bag and check that every message comes, in order and in time. `--help` says more."""

import sys

from relform_bags.check_command import main
from relform_core.script import run_script

if __name__ == "__main__":
    sys.exit(run_script(main))
