#!/usr/bin/env python3
"""Measure the CPU time of a control step over ROS, process by process. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_bringup.cpu_per_step")
