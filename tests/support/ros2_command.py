"""Command lines for ros2, in the shell of a user."""

import subprocess
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

N_AT_ONCE = 10
"""Commands that run in parallel; most of their time they wait."""


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
    return Answer(without_middleware(done.stdout), without_middleware(done.stderr), done.returncode)


def without_middleware(text: str) -> str:
    """The text without the warnings of the middleware, which occur on a busy machine."""
    return "".join(line for line in text.splitlines(keepends=True) if "RTPS_" not in line)


def ask_all(sequences: list[list[str]], environment: Mapping[str, str], folder: Path) -> dict[str, Answer]:
    """The answers to sequences of command lines, of which several run at once."""

    def in_turn(commands: list[str]) -> dict[str, Answer]:
        return {command: ask(command, environment, folder) for command in commands}

    with ThreadPoolExecutor(N_AT_ONCE) as pool:
        return {command: answer for done in pool.map(in_turn, sequences) for command, answer in done.items()}
