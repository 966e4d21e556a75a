#!/usr/bin/env python3
"""Read a recorded flight: `.venv/bin/python examples/read_recording.py runs/latest`."""

import sys

from relform_analysis.flight.from_bag import read_flight_log
from relform_analysis.flight.metrics import flight_metrics

log = read_flight_log(sys.argv[1] if len(sys.argv) > 1 else "runs/latest")
steady = flight_metrics(log).score.formation.steady
print(f"{len(log.vehicles)} vehicles, {log.step_ns[-1] / 1e9:.1f} s, formation error {steady.mean:.4f} m")
