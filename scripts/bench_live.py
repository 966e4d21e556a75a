#!/usr/bin/env python3
"""Measure the view in a headless browser: evenness, cost for larger teams, and memory. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_live.bench")
