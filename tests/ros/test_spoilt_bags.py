"""Whatever is wrong in a bag: every command that reads it gives its result, or one line and nothing else.

The long form: ``RELFORM_EXAMPLES=400 pytest --timeout 0 tests/ros/test_spoilt_bags.py``.
"""

import contextlib
import os
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from relform_analysis.replay.command import main as replay
from relform_analysis.report.command import main as report
from relform_bags.foxglove.command import main as foxglove
from relform_bags.info import format_information, read_information
from relform_bags.path_export.command import main as export_path
from relform_core.errors import BagError
from relform_core.exit_codes import EXIT_USAGE
from relform_live.from_bag import read_recording
from support.spoilt_files import with_other_bytes

EXAMPLES = int(os.environ.get("RELFORM_EXAMPLES", "5"))
FLIGHT = Path(__file__).parents[1] / "data/short_flight"


def commands(run: Path) -> dict[str, Callable[[], int]]:
    return {
        "report": lambda: report([str(run), "--no-figures", "--out", str(run / "report.html")]),
        "replay": lambda: replay([str(run)]),
        "foxglove": lambda: foxglove([str(run), "--out", str(run / "foxglove")]),
        "export_path": lambda: export_path([str(run), "--out", str(run / "path.csv")]),
    }


@given(seed=st.integers(0, 2**32))
@settings(max_examples=EXAMPLES, suppress_health_check=list(HealthCheck))
def test_spoilt_bags(
    seed: int, tmp_path_factory: pytest.TempPathFactory, capsys: pytest.CaptureFixture[str]
) -> None:
    random = Random(seed)
    run = tmp_path_factory.mktemp("run")
    (run / "bag").mkdir()
    spoilt = random.choice(("bag_0.mcap", "bag_0.mcap", "metadata.yaml"))
    for file in FLIGHT.iterdir():
        content = file.read_bytes()
        changed = with_other_bytes(content, random) if file.name == spoilt else content
        (run / "bag" / file.name).write_bytes(changed)
    for name, command in commands(run).items():
        capsys.readouterr()
        code = command()
        errors = capsys.readouterr().err.splitlines()
        if code == EXIT_USAGE:
            assert errors, name
            assert all(line.startswith("error: ") and line.isprintable() for line in errors), (name, errors)
            left = {"report": "report.html", "foxglove": "foxglove", "export_path": "path.csv"}.get(name)
            assert left is None or not (run / left).exists(), name
        else:
            assert not any("Traceback" in line for line in errors), name
    for read in (lambda: format_information(read_information(run / "bag")), lambda: read_recording(run)):
        with contextlib.suppress(BagError):  # any other error fails the test
            read()
