#!/usr/bin/env python3
"""Measure memory, time of a step and size of the bag in a long flight. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_bringup.memory_over_time")
