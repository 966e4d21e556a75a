"""A bag that is being recorded is known as such, until its recorder closes it or dies."""

import subprocess
import sys
from pathlib import Path

from relform_bags.recording_lock import is_being_recorded
from relform_bags.writer import BagWriter


def test_until_the_writer_closes_it(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag", {}) as writer:
        assert is_being_recorded(writer.file)
        assert is_being_recorded(tmp_path / "bag")
    assert not is_being_recorded(tmp_path / "bag")


def test_until_the_writer_is_killed(tmp_path: Path) -> None:
    code = (
        "import os, sys; from pathlib import Path; from relform_bags.writer import BagWriter\n"
        "BagWriter(Path(sys.argv[1]), {}).flush(); os.kill(os.getpid(), 9)"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "bag")], check=False)
    assert list(tmp_path.glob("bag/*.mcap"))
    assert not is_being_recorded(tmp_path / "bag")
