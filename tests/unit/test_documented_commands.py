"""Every command that the documentation shows is run by a test, or has a reason why not."""

import itertools
import re
import shlex
from pathlib import Path

import pytest

from relform_analysis.sweep.plan import load_variants
from relform_core.load import load_scenario
from support.documented_commands import CONSOLE, NOT_RUN, PAGES, RUN_ELSEWHERE, WALKED, is_listed
from support.pages_with_commands import WORKSPACE, Block, blocks

PYTHON = ".venv/bin/python "
LOOKS_LIKE_A_COMMAND = re.compile(
    r"^(\.venv/bin/|scripts/|examples/|(cd|docker|export|git|make|pip|python3?|ros2|source|ssh|sudo) )",
    re.MULTILINE,
)
SHOWN = {
    command
    for page in PAGES
    for block in blocks(page)
    if block.language == "sh"
    for command in block.commands
}


WALKED_COMMANDS = {
    command
    for page in WALKED
    for block in blocks(page)
    if block.language == "sh" and not any(map(is_listed, block.commands))
    for command in block.commands
}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_command_is_run_or_has_a_reason(page: Path) -> None:
    """Show the command on a page of ``WALKED``, or add it to tests/support/documented_commands.py."""
    shown = [command for block in blocks(page) if block.language == "sh" for command in block.commands]
    assert [each for each in shown if not is_listed(each) and each not in WALKED_COMMANDS] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_only_blocks_of_a_shell_hold_commands(page: Path) -> None:
    """Each block says what it holds: ``sh`` for commands, ``text`` for what is neither code nor commands."""

    def is_clear(block: Block) -> bool:
        if block.language == "console":
            return page == CONSOLE
        return block.language == "sh" or not LOOKS_LIKE_A_COMMAND.search(block.text)

    assert [block.text for block in blocks(page) if not block.language or not is_clear(block)] == []


def test_no_row_is_left_over() -> None:
    commands = {command.removeprefix(PYTHON) for command in SHOWN}
    assert sorted((RUN_ELSEWHERE.keys() | NOT_RUN.keys()) - commands) == []


@pytest.mark.parametrize(
    "command", sorted(each for each in SHOWN if "scripts/" in each and each not in WALKED_COMMANDS)
)
def test_scenarios_of_commands_that_other_tests_shorten_load(command: str) -> None:
    arguments = shlex.split(command)
    values = [(name, value) for name, value in itertools.pairwise(arguments) if name.startswith("--")]
    scenario = dict(values).get("--scenario", "paper")
    load_scenario(scenario, [value for name, value in values if name == "--set"])
    if "--variants" in dict(values):
        load_variants(dict(values)["--variants"])


@pytest.mark.parametrize("test", sorted(set(RUN_ELSEWHERE.values())))
def test_named_tests_exist(test: str) -> None:
    file, _, name = test.partition("::")
    assert f"\ndef {name}(" in (WORKSPACE / file).read_text()
