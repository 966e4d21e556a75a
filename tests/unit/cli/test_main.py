"""The end of the ros2 command."""

import subprocess
import sys

HANGS = """
from relform_cli import __main__ as command
command.LEAVE_MAX_S = 0.1
command.leave_in_time()
while True:
    pass
"""


def test_leave_in_time_ends_a_process_that_hangs() -> None:
    ended = subprocess.run([sys.executable, "-c", HANGS], capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stdout, ended.stderr) == (1, "", "")
