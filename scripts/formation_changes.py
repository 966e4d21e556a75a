#!/usr/bin/env python3
"""Draw the changes of formation of docs/nodes.md. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_analysis.plots.formation_changes")
