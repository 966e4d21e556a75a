"""The library that draws plots is the one that setup/vendor_uplot.sh fetched, unchanged."""

import hashlib
from pathlib import Path

import pytest

from relform_analysis.report.page import ASSETS, UPLOT

SUMS = [line.split() for line in (ASSETS / UPLOT / "SHA256SUMS").read_text().splitlines()]
SCRIPT = Path(__file__).parents[3] / "setup/vendor_uplot.sh"


@pytest.mark.parametrize(("expected", "name"), SUMS, ids=[name for _, name in SUMS])
def test_file_is_unchanged(expected: str, name: str) -> None:
    assert hashlib.sha256((ASSETS / UPLOT / name).read_bytes()).hexdigest() == expected


def test_version_is_that_of_the_script() -> None:
    version = next(
        line.partition("=")[2] for line in SCRIPT.read_text().splitlines() if line.startswith("VERSION=")
    )
    assert f"uPlot (v{version}) */" in (ASSETS / UPLOT / "uPlot.iife.min.js").read_text()[:100]
