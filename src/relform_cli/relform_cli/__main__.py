"""``python -m relform_cli``: the ``ros2`` command of this environment."""

import faulthandler
import importlib
import os
import signal
import sys
from typing import NoReturn

import argcomplete
from argcomplete.lexers import split_line

from relform_cli.commands import OneLineParser, command_modules, description_of

DESCRIPTION = "The ros2 command of an environment without ros2cli."
LEAVE_MAX_S = 5.0


def build_parser(words: list[str]) -> OneLineParser:
    """The parser of a command line; imports only the command that it names."""
    parser = OneLineParser(prog="ros2", description=DESCRIPTION)
    parser.add_argument(
        "--use-python-default-buffering",
        action="store_true",
        help="leave the buffering of stdout to Python instead of flushing each line",
    )
    parser.set_defaults(run=lambda _: parser.print_help())
    selected = next((word for word in words if not word.startswith("-")), None)
    commands = parser.add_subparsers(title="commands", metavar="command")
    for name, module in sorted(command_modules().items()):
        description = description_of(module)
        command_parser = commands.add_parser(name, help=description, description=description)
        if name == selected:
            importlib.import_module(module).add_arguments(command_parser)
    return parser


def command_line_to_complete() -> list[str] | None:
    """The words after ``ros2`` on the shell's line when the shell asks for completions, else None."""
    if "_ARGCOMPLETE" not in os.environ:
        return None
    _, _, _, words, _ = split_line(os.environ["COMP_LINE"], int(os.environ["COMP_POINT"]))
    return words[1:]


def terminate(*_: object) -> NoReturn:
    sys.exit(signal.SIGTERM)


def leave_in_time() -> None:
    """End this process with exit code 1 if it still runs after ``LEAVE_MAX_S``.

    Fast DDS 2.14 can block forever, and ignore signals, when several nodes leave at the same time.
    """
    devnull = os.open(os.devnull, os.O_WRONLY)
    faulthandler.dump_traceback_later(LEAVE_MAX_S, exit=True, file=devnull)


def main() -> int:
    """Exit code: 0, 1 on errors, 2 on wrong arguments and on SIGINT, 15 on SIGTERM."""
    signal.signal(signal.SIGTERM, terminate)
    words = command_line_to_complete()
    try:
        parser = build_parser(sys.argv[1:] if words is None else words)
        argcomplete.autocomplete(parser, always_complete_options=False)
        arguments = parser.parse_args()
        if sys.stdout and not arguments.use_python_default_buffering:
            sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]  # a TextIOWrapper here
        return arguments.run(arguments) or 0
    except KeyboardInterrupt:
        leave_in_time()
        return signal.SIGINT
    except BrokenPipeError:  # a reader such as head closed the pipe
        leave_in_time()
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (RuntimeError, OSError) as error:
        print(error, file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
