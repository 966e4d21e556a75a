"""How every command of relform reports an error and ends."""

import argparse
import functools
import os
import sys
from collections.abc import Callable
from typing import NoReturn, ParamSpec

from relform_core.errors import RelformError
from relform_core.exit_codes import EXIT_FAILURE, EXIT_INTERRUPTED, EXIT_USAGE
from relform_core.suggestions import did_you_mean

Arguments = ParamSpec("Arguments")


class CommandParser(argparse.ArgumentParser):
    """The parser of a command line; wrong usage has the form of every other error."""

    def error(self, message: str) -> NoReturn:
        """Print one line and exit with ``EXIT_USAGE``."""
        if message.startswith("unrecognized arguments: "):
            option = message.split()[2].partition("=")[0]
            message += did_you_mean(option, self._option_string_actions)
        print_error(f"{message}; see {self.prog} --help")
        raise SystemExit(EXIT_USAGE)

    def add_overrides(self, help: str) -> None:
        """Add the option ``--set KEY=VALUE``, whose texts are ``overrides`` of ``load_scenario``."""
        self.add_argument(
            "--set", action="append", default=[], dest="overrides", metavar="KEY=VALUE", help=help
        )


def command(main: Callable[Arguments, int]) -> Callable[Arguments, int]:
    """Decorate the main function of a command, which returns its exit code.

    An error of relform becomes one line ``error: ...`` per problem and ``EXIT_USAGE``, Ctrl-C
    ``EXIT_INTERRUPTED``, and a reader such as ``head`` that closes the output ``EXIT_FAILURE``.
    """

    @functools.wraps(main)
    def run(*args: Arguments.args, **kwargs: Arguments.kwargs) -> int:
        try:
            code = main(*args, **kwargs)
            sys.stdout.flush()
        except RelformError as error:
            print_error(error)
            return EXIT_USAGE
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return EXIT_FAILURE
        except KeyboardInterrupt:
            return EXIT_INTERRUPTED
        return code

    return run


def print_error(error: object) -> None:
    """Print an error to stderr, each of its lines after ``error:``."""
    for line in str(error).splitlines():
        print(f"error: {line}", file=sys.stderr)


def positive(text: str) -> int:
    """A whole number of at least 1 on a command line."""
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1, not {number}")
    return number
