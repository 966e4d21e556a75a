#!/usr/bin/env python3
"""Feed a recorded flight to the controller again and compare its commands. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_analysis.replay.command")
