#!/usr/bin/env python3
"""Do something to flights on the wall clock, and check what they do then. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_bringup.faults.command")
