#!/usr/bin/env python3
"""Fly a scenario over many seeds and variants, without ROS and in parallel; resumable. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_analysis.sweep.command")
