"""The commands of the tutorial and of the how-to pages, run one after the other as a reader would."""

import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import domain_coordinator
import pytest

from relform_core.exit_codes import EXIT_INTERRUPTED
from support.pages_with_commands import WORKSPACE, Block, make_room, sections
from support.ports import free_port
from support.processes import wait_until

TUTORIAL = WORKSPACE / "docs/tutorial.md"
HOW_TO = WORKSPACE / "docs/how_to.md"
TIMEOUT_S = 90.0


@pytest.mark.parametrize("page", [TUTORIAL, HOW_TO], ids=lambda page: page.stem)
def test_page_uses_known_notes(page: Path) -> None:
    """A block that nothing runs or saves is a ``text``."""
    blocks = [block for section in sections(page) for block in section]
    assert {block.note for block in blocks if block.language == "sh"} <= {"", "background", "fails"}
    assert all(block.note.endswith(block.language) for block in blocks if block.language in ("yaml", "csv"))
    assert {block.language for block in blocks} <= {"sh", "text", "yaml", "csv"}


@pytest.mark.timeout(240)  # half a minute on a machine that does nothing else
def test_every_command_of_the_tutorial_works(tmp_path: Path) -> None:
    follow(sections(TUTORIAL), tmp_path)


@pytest.mark.parametrize("section", sections(HOW_TO), ids=range(len(sections(HOW_TO))))
def test_every_command_of_a_recipe_works(section: list[Block], tmp_path: Path) -> None:
    """Recipes do not need each other."""
    follow([section], tmp_path)


def follow(page: list[list[Block]], folder: Path) -> None:
    """Save the files and run the commands of a page, one after the other."""
    make_room(folder)
    with domain_coordinator.domain_id() as domain:
        environment = os.environ | {"ROS_DOMAIN_ID": str(domain)}
        for section in page:
            with ExitStack() as stack:  # what runs in the background ends with its section
                for block in section:
                    if block.language in ("yaml", "csv"):
                        (folder / block.note).write_text(block.text)
                    elif block.language == "sh" and block.note == "background":
                        stack.enter_context(in_background(block, folder, environment))
                    elif block.language == "sh":
                        run(block, folder, environment)


def run(block: Block, folder: Path, environment: dict[str, str]) -> None:
    """Run a block in a shell that ends at the first error; `make` belongs to the workspace."""
    finished = subprocess.run(
        ["bash", "-e", "-c", block.text],
        cwd=WORKSPACE if block.text.startswith("make ") else folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
    )
    shown = f"{block.text}\n{finished.stdout}\n{finished.stderr}"
    assert (finished.returncode != 0) == (block.note == "fails"), shown


@contextmanager
def in_background(block: Block, folder: Path, environment: dict[str, str]) -> Iterator[None]:
    """Run one command until the block ends, as with Ctrl-C; a view gets a port that is free here."""
    command = block.text.split()
    if "scripts/live.py" in command:
        command += ["--port", str(free_port())]
    log = folder / f"{Path(command[1]).stem}.log"
    with log.open("w") as stream:
        process = subprocess.Popen(
            command, cwd=folder, env=environment, stdout=stream, stderr=subprocess.STDOUT
        )
    try:
        wait_until(lambda: log.stat().st_size > 0 or process.poll() is not None, TIMEOUT_S)
        yield
        assert process.poll() is None, log.read_text()
        process.send_signal(signal.SIGINT)
        assert process.wait(TIMEOUT_S) in (0, EXIT_INTERRUPTED), log.read_text()
    finally:
        process.kill()
        process.wait()
