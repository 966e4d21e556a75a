"""The documentation names files that exist."""

import re
from pathlib import Path

import pytest

WORKSPACE = Path(__file__).parents[2]
PAGES = sorted((WORKSPACE / "docs").glob("**/*.md")) + [
    WORKSPACE / "README.md",
    WORKSPACE / "CONTRIBUTING.md",
]
LINK = re.compile(r"\]\((?!https?:)([^)#\s]+)")
PYTHON_FILE = re.compile(r"`(?:src/)?((?:[\w-]+/)*[\w-]+\.py)`")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_to_files(page: Path) -> None:
    broken = [link for link in LINK.findall(page.read_text()) if not (page.parent / link).exists()]
    assert broken == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_named_python_files_exist(page: Path) -> None:
    """A name stands for a file whose path ends in it: pages leave out the folders that the text names."""
    files = [f"/{path.relative_to(WORKSPACE)}" for folder in ("src", "tests", "scripts", "setup") for path in
             (WORKSPACE / folder).glob("**/*.py")]  # fmt: skip
    named = PYTHON_FILE.findall(page.read_text())
    missing = [name for name in named if not any(file.endswith(f"/{name}") for file in files)]
    assert missing == []
