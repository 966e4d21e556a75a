"""How commands report errors and end."""

import subprocess
import sys

import pytest

from relform_core.errors import ConfigError
from relform_core.script import CommandParser, command

FLOOD = """
import sys
from relform_core.script import command

@command
def main() -> int:
    for number in range(100_000):
        print(number)
    return 0

sys.exit(main())
"""


def test_exit_code_is_that_of_the_command() -> None:
    assert command(lambda code: code)(7) == 7


def test_each_problem_is_one_line_on_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    @command
    def main() -> int:
        raise ConfigError("a.yaml: seed: missing key\na.yaml: wings: unknown key")

    assert main() == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err == "error: a.yaml: seed: missing key\nerror: a.yaml: wings: unknown key\n"


def test_ctrl_c_is_no_traceback() -> None:
    @command
    def main() -> int:
        raise KeyboardInterrupt

    assert main() == 130


def test_closed_output_is_no_traceback() -> None:
    with subprocess.Popen(
        [sys.executable, "-c", FLOOD], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as run:
        assert run.stdout is not None
        assert run.stderr is not None
        run.stdout.readline()
        run.stdout.close()
        assert run.stderr.read() == b""
    assert run.returncode == 1


def test_wrong_usage_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    parser = CommandParser(prog="fly")
    parser.add_argument("--seed", type=int)
    with pytest.raises(SystemExit) as exit_:
        parser.parse_args(["--seed", "many"])
    assert exit_.value.code == 2
    assert capsys.readouterr().err == "error: argument --seed: invalid int value: 'many'; see fly --help\n"
