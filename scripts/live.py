#!/usr/bin/env python3
"""Show a flight in a browser, while it is flown or from its bag. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_live.command")
