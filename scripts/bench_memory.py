#!/usr/bin/env python3
"""Measure the memory of every process of a long hover in real time. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_bringup.memory_over_time")
