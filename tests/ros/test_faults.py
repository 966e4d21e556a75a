"""The fault campaign in short: a few flights with real processes, and the report of `scripts/faults.py`."""

import json
import subprocess
import sys
from pathlib import Path

FAULTS = Path(__file__).parents[2] / "scripts/faults.py"
CASES = [
    "stop-controller:1",
    "clock-jump:2",
    "stop-vehicle:3",
    "slow-disk:4",
    "restart-controller:5",
    "kill-fly:6",
]


def test_a_short_campaign_passes(tmp_path: Path) -> None:
    command = [sys.executable, str(FAULTS), "--jobs", "2", "--out", str(tmp_path), "--case", *CASES]
    finished = subprocess.run(command, capture_output=True, text=True, timeout=110, check=False)
    assert (finished.returncode, finished.stderr) == (0, ""), finished.stdout
    summary = json.loads((tmp_path / "faults.json").read_text())
    assert (summary["cases"], summary["passed"], summary["failed"]) == (len(CASES), len(CASES), [])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cases", "faults.json"]  # nothing to look at
