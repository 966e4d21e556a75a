"""A node that waits while the clock of the machine is set back."""

import subprocess
import sys
from pathlib import Path

from relform_bringup.faults.shim import Shim

WAIT = """
import time
import rclpy
from relform_ros.spinner import Spinner, until

async def logic():
    print("waits", flush=True)
    began = time.monotonic()
    await until(lambda: time.monotonic() > began + 1.5)
    print(time.monotonic() - began, flush=True)

rclpy.init()
Spinner(rclpy.create_node("waiting")).run([logic()])
"""
BACK_S = 60.0


def test_a_wait_is_not_longer_by_the_time_that_the_clock_was_set_back(tmp_path: Path) -> None:
    shim = Shim(tmp_path / "shim")
    command = [*shim.command, sys.executable, "-c", WAIT]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as node:
        assert node.stdout is not None
        assert node.stdout.readline() == "waits\n"
        shim.jump(-BACK_S)
        out, _ = node.communicate(timeout=50)
    assert 1.5 < float(out) < BACK_S / 2
