#!/usr/bin/env python3
"""Make a picture of a report for the documentation. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_analysis.report.screenshot")
