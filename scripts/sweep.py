#!/usr/bin/env python3
"""Fly a scenario over many seeds and variants, without ROS and in parallel; resumable. `--help` says more."""

import sys

from relform_analysis.sweep.command import main
from relform_core.script import run_script

if __name__ == "__main__":
    sys.exit(run_script(main))
