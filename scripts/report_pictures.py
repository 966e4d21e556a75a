#!/usr/bin/env python3
"""Make the pictures of reports in docs/images. `--help` says more."""

from run_main import run_main

if __name__ == "__main__":
    run_main("relform_analysis.report.report_pictures")
