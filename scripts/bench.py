#!/usr/bin/env python3
"""Measure the speed of the solver and of a flight without ROS. `--help` says more."""

import sys

from relform_analysis.bench import main
from relform_core.script import run_script

if __name__ == "__main__":
    sys.exit(run_script(main))
