#!/usr/bin/env python3
"""Measure the SQP step beside acados, for several team sizes. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_analysis.bench.solver")
