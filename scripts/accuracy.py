#!/usr/bin/env python3
"""Fly the accuracy table, raw feedback beside the team estimator. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_analysis.accuracy.command")
