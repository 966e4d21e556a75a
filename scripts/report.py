#!/usr/bin/env python3
"""Make the report of a flight or a sweep: one HTML file that opens offline. `--help` says more."""

import sys

from relform_analysis.report.command import main
from relform_core.script import run_script

if __name__ == "__main__":
    sys.exit(run_script(main))
