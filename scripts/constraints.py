#!/usr/bin/env python3
"""Draw the flights of docs/constraints.md, with and without their constraints. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_analysis.plots.constraint_scenarios")
