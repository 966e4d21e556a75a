"""The machine's C compiler behind a script: it counts compilations, and can exchange flags."""

import shutil
from pathlib import Path

import pytest


class Compiler:
    """A script that counts how often it compiles.

    Args:
        folder: of the script and its log.
        instead_of_native: flags in place of ``-march=native``.
    """

    def __init__(self, folder: Path, instead_of_native: str = "-march=native") -> None:
        real = shutil.which("cc") or shutil.which("gcc")
        if real is None:
            pytest.skip("there is no C compiler")
        self.path = folder / "counting-cc"
        self._log = folder / "log"
        self.path.write_text(
            "#!/bin/sh\n"
            f'[ "$1" = --version ] || echo "$@" >> {self._log}\n'
            f'for flag; do shift; case "$flag" in -march=native) set -- "$@" {instead_of_native};;'
            ' *) set -- "$@" "$flag";; esac; done\n'
            f'exec {real} "$@"\n'
        )
        self.path.chmod(0o755)

    def compile_together(self, n_processes: int) -> None:
        """Let no compilation begin before this many processes ask for one."""
        wait = f"while [ $(wc -l < {self._log}) -lt {n_processes} ]; do sleep 0.01; done"
        script = self.path.read_text()
        self.path.write_text(script.replace("exec", f'[ "$1" = --version ] || {wait}\nexec'))

    @property
    def count(self) -> int:
        """Compilations so far, by all processes."""
        return len(self._log.read_text().splitlines()) if self._log.exists() else 0


def use_compiler(monkeypatch: pytest.MonkeyPatch, folder: Path, compiler: Compiler) -> None:
    """Let the rest of a test compile with this compiler, into an empty cache in a folder."""
    monkeypatch.setenv("CC", str(compiler.path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
