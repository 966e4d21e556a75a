"""Commands and their verbs.

A command is a module with a function ``add_arguments(parser)``; the first line of its docstring is the help.
The function calls ``parser.set_defaults(run=...)``. ``run`` takes the parsed arguments and returns the exit
code, or None for success; it may raise RuntimeError with one line for the user. A package adds the command
NAME by an entry point in its setup.py::

    entry_points={"relform_cli.commands": ["NAME = package.module"]}
"""

import ast
import importlib.util
import pkgutil
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from importlib.metadata import entry_points
from pathlib import Path
from typing import NoReturn

import relform_cli

ENTRY_POINT_GROUP = "relform_cli.commands"
OWN_SUFFIX = "_command"

Run = Callable[[Namespace], int | None]


class OneLineParser(ArgumentParser):
    """Reports wrong arguments in one line, without the usage, and exits with 2."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}; see {self.prog} --help\n")


class VerbParsers:
    """The verbs of a command. Without a verb the command prints its help."""

    def __init__(self, parser: ArgumentParser) -> None:
        self._parsers = parser.add_subparsers(title="verbs", metavar="verb")
        parser.set_defaults(run=lambda _: parser.print_help())

    def add(self, name: str, run: Run) -> ArgumentParser:
        """Add a verb that runs a function; the first line of the function's docstring is the help."""
        description = first_line(run.__doc__)
        parser = self._parsers.add_parser(name, help=description, description=description)
        parser.set_defaults(run=run)
        return parser


def first_line(docstring: str | None) -> str:
    return (docstring or "").partition("\n")[0]


def command_modules() -> dict[str, str]:
    """The module of each command."""
    modules = {point.name: point.module for point in entry_points(group=ENTRY_POINT_GROUP)}
    for module in pkgutil.iter_modules(relform_cli.__path__, prefix="relform_cli."):
        if module.name.endswith(OWN_SUFFIX):
            modules[module.name.removeprefix("relform_cli.").removesuffix(OWN_SUFFIX)] = module.name
    return modules


def description_of(module: str) -> str:
    """The first line of a module's docstring, read from its source: an import may take long."""
    specification = importlib.util.find_spec(module)
    if specification is None or specification.origin is None:
        return ""
    return first_line(ast.get_docstring(ast.parse(Path(specification.origin).read_text())))
