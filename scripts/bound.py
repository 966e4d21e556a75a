#!/usr/bin/env python3
"""Compare the team estimator with the Cramer-Rao bound of its sensors. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_analysis.judges.command")
