#!/usr/bin/env python3
"""Fly the paper's evaluation again: its figures, its claims, its ablations. `--help` says more."""

import sys

from relform_analysis.evaluation.command import main
from relform_core.script import run_script

if __name__ == "__main__":
    sys.exit(run_script(main))
