"""Fly a scenario over many seeds and variants, without ROS and in parallel; resumable. `--help` says more."""

import sys

from relform_tools.sweep_command import main

if __name__ == "__main__":
    sys.exit(main())
