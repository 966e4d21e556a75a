#!/usr/bin/env python3
"""Play a bag and check that every message comes, in order and in time. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_bags.check_command")
