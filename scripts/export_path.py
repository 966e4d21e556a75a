#!/usr/bin/env python3
"""Write the path of a vehicle in a bag as a CSV file, which a scenario can fly. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_bags.path_export.command")
