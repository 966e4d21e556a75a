#!/usr/bin/env python3
"""Write docs/configuration.md and the JSON Schemas of configuration files. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_bringup.configuration.command")
