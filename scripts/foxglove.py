#!/usr/bin/env python3
"""Copy a recorded flight into a bag that Foxglove draws in 3D as well. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_bags.foxglove.command")
