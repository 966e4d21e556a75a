#!/usr/bin/env python3
"""Fly a scenario with real nodes, one process each, recorded and scored. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_bringup.command")
