#!/usr/bin/env python3
"""Make the report of a flight or a sweep: one HTML file that opens offline. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_analysis.report.command")
