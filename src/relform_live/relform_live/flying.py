"""A flight that the view starts."""

import os
import signal
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from relform_bringup.supervisor import find_setpriv
from relform_core.installed import executable
from relform_core.ros_domain import claimed_domain


@contextmanager
def flying(arguments: Sequence[str]) -> Iterator[subprocess.Popen[bytes]]:
    """The command ``fly`` in this terminal; it is interrupted at the end of the block, if it still runs.

    This process gets the ROS domain of the flight. Ctrl-C reaches this process only, which passes one signal
    on: a second one would keep ``fly`` from writing its report.

    Raises:
        FlightError: the command is not installed, or there is no free ROS domain.
    """
    program = [find_setpriv(), "--pdeathsig", "INT", "--", executable("relform_bringup", "fly")]
    with claimed_domain() as domain_id:
        pass  # ``fly`` claims it now
    os.environ["ROS_DOMAIN_ID"] = str(domain_id)
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    process = subprocess.Popen([*program, *arguments], process_group=0)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        process.wait()
