"""The verbs ``list`` and ``find``, which topics and services have in common."""

from argparse import SUPPRESS, ArgumentParser, Namespace
from typing import Any

from relform_cli.completion import completed_by
from relform_cli.graph import NamesAndTypes, add_graph_arguments
from relform_cli.interfaces import EXAMPLES, all_interfaces


def add_hidden_argument(parser: ArgumentParser, plural: str, default: Any = SUPPRESS) -> None:
    """Add the option ``--include-hidden-topics``, or of another plural."""
    parser.add_argument(
        f"--include-hidden-{plural}",
        dest="include_hidden",
        action="store_true",
        default=default,
        help=f"hidden {plural} as well",
    )


def add_list_arguments(parser: ArgumentParser, plural: str) -> None:
    """Add the options of ``list``."""
    add_graph_arguments(parser)
    parser.add_argument("-t", "--show-types", action="store_true", help="show the types as well")
    _add_count_argument(parser, plural)
    add_hidden_argument(parser, plural)


def add_find_arguments(parser: ArgumentParser, plural: str, kind: str) -> None:
    """Add the arguments of ``find``: a type of a kind (msg or srv), and options."""
    add_graph_arguments(parser)
    argument = parser.add_argument("type", help=f"such as {EXAMPLES[kind]}")
    completed_by(lambda **_: all_interfaces(kind), argument)
    _add_count_argument(parser, plural)
    add_hidden_argument(parser, plural)


def _add_count_argument(parser: ArgumentParser, plural: str) -> None:
    parser.add_argument(
        "-c",
        f"--count-{plural}",
        dest="count",
        action="store_true",
        help=f"show only the number of {plural}",
    )


def print_list(found: NamesAndTypes, arguments: Namespace) -> None:
    if arguments.count:
        print(len(found))
        return
    for name, types in found:
        print(f"{name} [{', '.join(types)}]" if arguments.show_types else name)


def print_found(found: NamesAndTypes, arguments: Namespace) -> None:
    """Print the names of the given type."""
    names = [name for name, types in found if arguments.type in types]
    if arguments.count:
        print(len(names))
        return
    for name in names:
        print(name)
