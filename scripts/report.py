#!/usr/bin/env python3
"""Make the report of a flight or a sweep: one HTML file that opens offline. `--help` says more."""

import sys

from relform_tools.report.command import main

if __name__ == "__main__":
    sys.exit(main())
