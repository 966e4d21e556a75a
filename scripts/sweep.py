#!/usr/bin/env python3
"""Fly a scenario over many seeds and variants, without ROS and in parallel; resumable. `--help` says more."""

import sys

from relform_tools.script import run_script
from relform_tools.sweep_command import main

if __name__ == "__main__":
    sys.exit(run_script(main))
