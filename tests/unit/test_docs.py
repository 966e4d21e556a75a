"""The documentation names files that exist."""

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from relform_core.yaml_files import read_mapping

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


def test_citation_is_that_of_this_version_and_of_the_readme() -> None:
    """Its form was checked with cffconvert; ``preferred-citation`` is the paper."""
    citation = read_mapping(WORKSPACE / "CITATION.cff")
    version = ElementTree.parse(WORKSPACE / "src/relform_core/package.xml").getroot().findtext("version")
    assert citation["version"] == version
    assert f"]({citation['preferred-citation']['url']})" in (WORKSPACE / "README.md").read_text()
