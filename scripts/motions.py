#!/usr/bin/env python3
"""Draw the motions of the leader of docs/scenarios.md. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_analysis.plots.motions")
