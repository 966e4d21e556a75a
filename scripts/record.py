#!/usr/bin/env python3
"""Record the topics of a running system into a bag, or complete a bag. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_bags.record_command")
