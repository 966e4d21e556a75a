"""A flight whose controller crashes in its compiled code."""

import os
import re
import subprocess
import sys
from pathlib import Path

from support.compilers import Compiler
from support.nodes import short
from support.scenarios import PAPER

FLY = Path(__file__).parents[2] / "scripts/fly.py"
CRASHES_LATER = "static int calls; if (++calls > 40) *(volatile int *)0 = 1;"


def test_a_crash_in_compiled_code_is_named(tmp_path: Path) -> None:
    compiler = Compiler(tmp_path)
    edit = f"s/^int feedback(Team \\*t) {{/& {CRASHES_LATER}/"
    script = compiler.path.read_text()
    compiler.path.write_text(
        script.replace(
            "exec", f"for file; do case $file in *.c) sed -i '{edit}' \"$file\";; esac; done\nexec"
        )
    )
    environment = os.environ | {"CC": str(compiler.path), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    command = [
        sys.executable,
        str(FLY),
        "--scenario",
        str(PAPER),
        "--no-record",
        "--out",
        str(tmp_path / "run"),
    ]
    run = subprocess.run(
        [*command, "--set", short(20.0)], env=environment, capture_output=True, text=True, timeout=110
    )
    assert run.returncode == 1
    assert re.fullmatch(
        rf"error: /formation/controller was killed by SIGSEGV: its compiled code has crashed; if it does so "
        rf"again, delete {tmp_path}/cache/relform in step \d+ \(\d\.\d\d s\)\n",
        run.stderr,
    ), run.stderr
