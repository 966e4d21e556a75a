#!/usr/bin/env python3
"""Fly the paper's evaluation again: its figures, its claims, its ablations. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_analysis.evaluation.command")
