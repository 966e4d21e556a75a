"""Command lines for ros2 in the shell of a user, and nodes for them."""

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import domain_coordinator

LIVE_NODES = Path(__file__).parents[1] / "ros/live_nodes.py"

N_AT_ONCE = 10
"""Commands that run in parallel; most of their time they wait."""


@contextmanager
def live_nodes_process() -> Iterator[tuple[subprocess.Popen[str], dict[str, str]]]:
    """live_nodes.py in a domain of its own, and the environment of a shell there, where ros2 is ours."""
    python = Path(sys.executable)
    with domain_coordinator.domain_id() as domain:
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain), "PATH": f"{python.parent}:/usr/bin:/bin"}
        with subprocess.Popen(
            [python, LIVE_NODES], env=environment, stdout=subprocess.PIPE, text=True
        ) as process:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            yield process, environment
            process.kill()


@dataclass(frozen=True)
class Answer:
    stdout: str
    stderr: str
    code: int


def ask(command: str, environment: Mapping[str, str], folder: Path) -> Answer:
    """Run a command line of bash for at most a minute."""
    done = subprocess.run(
        ["bash", "-c", command],
        env=environment,
        cwd=folder,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=60,
    )
    return Answer(done.stdout, done.stderr, done.returncode)


def ask_all(sequences: list[list[str]], environment: Mapping[str, str], folder: Path) -> dict[str, Answer]:
    """The answers to sequences of command lines, several of which run in parallel."""

    def in_turn(commands: list[str]) -> dict[str, Answer]:
        return {command: ask(command, environment, folder) for command in commands}

    with ThreadPoolExecutor(N_AT_ONCE) as pool:
        return {command: answer for done in pool.map(in_turn, sequences) for command, answer in done.items()}
