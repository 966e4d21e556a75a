"""docs/notation.md: the modules that it names exist and implement the equations that it names."""

import re
from pathlib import Path

import pytest

WORKSPACE = Path(__file__).parents[2]
NOTATION = (WORKSPACE / "docs/notation.md").read_text()
EQUATIONS = NOTATION.partition("## Equations")[2].partition("\n## ")[0]
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in EQUATIONS.splitlines()
    if line.startswith("| ") and not line.startswith("| label")
]


def module_text(name: str) -> str:
    package, _, path = name.partition("/")
    return (WORKSPACE / "src" / package / package / path).read_text()


@pytest.mark.parametrize("row", ROWS, ids=[row[0] for row in ROWS])
def test_modules_contain_the_equations_of_their_row(row: list[str]) -> None:
    labels, _, where = row
    names = set(re.findall(r"[A-Za-z_]{3,}", labels)) - {"Algorithm"}
    texts = {module: module_text(module) for module in re.findall(r"`(relform_\w+/[\w/]+\.py)`", where)}
    assert names
    assert texts
    for module, text in texts.items():
        assert any(name in text for name in names), f"{module} mentions none of {', '.join(sorted(names))}"
    for name in names:
        assert any(name in text for text in texts.values()), f"no module of the row mentions {name}"


def test_every_file_that_the_page_names_exists() -> None:
    for name in re.findall(r"`((?:relform_\w+|config|docs)/[\w/.]+)`", NOTATION):
        package, _, path = name.partition("/")
        place = WORKSPACE / (f"src/{package}/{package}/{path}" if package.startswith("relform") else name)
        assert place.exists(), name
