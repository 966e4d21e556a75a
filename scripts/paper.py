#!/usr/bin/env python3
"""Fly the paper's evaluation again: its figures, its claims, its ablations. `--help` says more."""

import sys

from relform_tools.evaluation.command import main

if __name__ == "__main__":
    sys.exit(main())
