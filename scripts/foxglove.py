#!/usr/bin/env python3
"""Copy a recorded flight into a bag that Foxglove draws in 3D as well. `--help` says more."""

import sys

from relform_tools.foxglove_command import main

if __name__ == "__main__":
    sys.exit(main())
