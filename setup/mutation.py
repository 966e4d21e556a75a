"""Test the tests: how many small changes of the code do they notice? `make mutation` runs this.

mutmut expects a package in src/<package>, ours are in src/<package>/<package>. So the packages with the
changed modules are copied into build/mutation, with the tests. pyproject.toml says which modules and tests.
"""

import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
STAGE = ROOT / "build/mutation"
PACKAGES = ("relform_controller", "relform_core")
COPIED = ("tests", "config", "examples", "docs", "scripts", "README.md", "pyproject.toml")
NOTICED = ("killed", "timeout", "segfault", "caught by type check")
KILLED_SHARE = 0.85
"""Of the changes of each module, at least."""


def prepare() -> None:
    """Copy what is new; what mutmut knows of unchanged modules stays."""
    for package in PACKAGES:
        copy(ROOT / "src" / package / package, STAGE / "src" / package)
    for name in COPIED:
        copy(ROOT / name, STAGE / name)


def copy(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    if source.is_file():
        shutil.copy2(source, target)
        return
    if target.exists():
        shutil.rmtree(target)
    shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))


def results() -> dict[str, Counter[str]]:
    """How many changes of each module ended how."""
    lines = mutmut("results", "--all", "true", capture_output=True, text=True).stdout.splitlines()
    ends: dict[str, Counter[str]] = {}
    for line in lines:
        name, _, end = line.strip().rpartition(": ")
        ends.setdefault(name.partition(".x")[0], Counter())[end] += 1
    return ends


def mutmut(*arguments: str, **options: object) -> subprocess.CompletedProcess[str]:
    command = [str(Path(sys.executable).with_name("mutmut")), *arguments]
    return subprocess.run(command, cwd=STAGE, check=True, **options)  # type: ignore[call-overload, no-any-return]


def main() -> int:
    prepare()
    mutmut("run", *sys.argv[1:])
    too_few = 0
    for module, ends in sorted(results().items()):
        share = sum(ends[end] for end in NOTICED) / ends.total()
        too_few += share < KILLED_SHARE
        print(f"{module}: {share:.1%} of {ends.total()} changes noticed ({dict(ends)})")
    print(f"show one: cd {STAGE.relative_to(ROOT)} && ../../.venv/bin/mutmut results")
    return int(too_few > 0)


if __name__ == "__main__":
    sys.exit(main())
