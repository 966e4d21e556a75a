#!/usr/bin/env python3
"""Measure the speed of the solver and of a flight without ROS. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_analysis.bench.flight")
