#!/usr/bin/env python3
"""Measure latency and missed steps of flights on the wall clock. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_bringup.real_time_bench")
