"""The commands of the tutorial and of the how-to pages, run in clean shells, as a reader would run them."""

import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import domain_coordinator
import pytest

from support.documented_commands import WALKED, is_listed
from support.pages_with_commands import WORKSPACE, Block, make_room, sections
from support.ports import free_port
from support.processes import wait_until

TUTORIAL, *HOW_TO = WALKED
RECIPES = [section for page in HOW_TO for section in sections(page)]
KEPT = ("HOME", "LANG", "USER")
"""Variables of a clean shell, beside a plain PATH."""
TIMEOUT_S = 90.0


@pytest.mark.parametrize("page", WALKED, ids=lambda page: page.stem)
def test_page_uses_known_notes(page: Path) -> None:
    """A block that nothing runs or saves is a ``text``."""
    blocks = [block for section in sections(page) for block in section]
    assert {block.note for block in blocks if block.language == "sh"} <= {"", "background", "fails"}
    assert all(block.note.endswith(block.language) for block in blocks if block.language in ("yaml", "csv"))
    assert {block.language for block in blocks} <= {"sh", "text", "yaml", "csv"}


@pytest.mark.timeout(240)  # half a minute on a machine that does nothing else
def test_every_command_of_the_tutorial_works(tmp_path: Path) -> None:
    follow(sections(TUTORIAL), tmp_path)


@pytest.mark.parametrize("section", RECIPES, ids=range(len(RECIPES)))
def test_every_command_of_a_recipe_works(section: list[Block], tmp_path: Path) -> None:
    """Recipes do not need each other."""
    follow([section], tmp_path)


def follow(page: list[list[Block]], folder: Path) -> None:
    """Save the files and run the commands of a page, one after the other."""
    make_room(folder)
    with domain_coordinator.domain_id() as domain:
        clean = {name: os.environ[name] for name in KEPT if name in os.environ}
        environment = clean | {"PATH": "/usr/local/bin:/usr/bin:/bin", "ROS_DOMAIN_ID": str(domain)}
        for section in page:
            with ExitStack() as stack:  # what runs in the background ends with its section
                for block in section:
                    if block.language in ("yaml", "csv"):
                        (folder / block.note).write_text(block.text)
                    elif block.language == "sh" and not any(map(is_listed, block.commands)):
                        if block.note == "background":
                            stack.enter_context(in_background(block, folder, environment))
                        else:
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
    """Run `make live` until the block ends, as with Ctrl-C: in one process, with a port that is free here."""
    (command,) = block.commands
    assert command == "make live"
    out, log = folder / "runs/live", folder / "live.log"
    with log.open("w") as stream:
        process = subprocess.Popen(
            [*command.split(), f"PORT={free_port()}", f"ARGS=--composed --out {out}"],
            cwd=WORKSPACE,
            env=environment,
            stdout=stream,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # Ctrl-C reaches all that runs in a terminal
        )
    try:
        wait_until(lambda: "http://" in log.read_text() or process.poll() is not None, TIMEOUT_S)
        yield
        assert process.poll() is None, log.read_text()
        os.killpg(process.pid, signal.SIGINT)
        process.wait(TIMEOUT_S)
        assert (out / "report.html").exists(), log.read_text()
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
