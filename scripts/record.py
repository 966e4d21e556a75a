#!/usr/bin/env python3
"""Record the topics of a running system into a bag, or complete a bag. `--help` says more."""

import sys

from relform_bags.record_command import main
from relform_core.script import run_script

if __name__ == "__main__":
    sys.exit(run_script(main))
