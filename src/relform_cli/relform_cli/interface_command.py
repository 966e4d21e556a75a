"""Interface types: messages, services and actions."""

import sys
from argparse import ArgumentParser, Namespace

from relform_cli.commands import VerbParsers
from relform_cli.completion import completed_by
from relform_cli.errors import CommandError
from relform_cli.interfaces import KINDS, all_interfaces, definition, interface_packages, interfaces


def add_arguments(parser: ArgumentParser) -> None:
    verbs = VerbParsers(parser)
    add_kinds(verbs.add("list", list_interfaces))

    verb = verbs.add("package", list_package)
    add_kinds(verb)
    completed_by(lambda **_: interface_packages(), verb.add_argument("package_name"))

    add_kinds(verbs.add("packages", list_packages))

    verb = verbs.add("show", show)
    comments = verb.add_mutually_exclusive_group()
    comments.add_argument(
        "--all-comments", action="store_true", help="show the comments of nested types, too"
    )
    comments.add_argument("--no-comments", action="store_true", help="show neither comments nor blank lines")
    completed_by(
        lambda **_: all_interfaces(),
        verb.add_argument("type", help="such as std_msgs/msg/String; - reads it from stdin"),
    )


def add_kinds(parser: ArgumentParser) -> None:
    for kind, short, long in (("msg", "m", "msgs"), ("srv", "s", "srvs"), ("action", "a", "actions")):
        parser.add_argument(f"-{short}", f"--only-{long}", dest="kinds", action="append_const", const=kind)


def chosen_kinds(arguments: Namespace) -> list[str]:
    return [kind for kind in KINDS if kind in (arguments.kinds or KINDS)]


def list_interfaces(arguments: Namespace) -> None:
    """List all types."""
    for kind in chosen_kinds(arguments):
        print(f"{KINDS[kind]}:", *all_interfaces(kind), sep="\n    ")


def list_package(arguments: Namespace) -> None:
    """List the types of a package."""
    for name in interfaces(arguments.package_name, *chosen_kinds(arguments)):
        print(f"{arguments.package_name}/{name}")


def list_packages(arguments: Namespace) -> None:
    """List the packages that define types."""
    for package in interface_packages():
        if interfaces(package, *chosen_kinds(arguments)):
            print(package)


def show(arguments: Namespace) -> None:
    """Show the definition of a type, and of those that it is made of."""
    type_ = sys.stdin.readline().strip() if arguments.type == "-" else arguments.type
    if not type_:
        raise CommandError("The passed type is empty; give one, such as std_msgs/msg/String")
    print_definition(type_, not arguments.no_comments, arguments.all_comments)


def print_definition(type_: str, comments: bool, nested_comments: bool, indent: str = "") -> None:
    path = definition(type_)
    for line in path.read_text().splitlines():
        code, hash_, comment = line.rstrip().partition("#")
        text = f"{code}{hash_}{comment}" if comments else code.rstrip()
        if text:
            print(f"{indent}{text}")
        elif comments:
            print()
        nested = nested_type(type_, code)
        if nested and path.suffix != ".idl":
            print_definition(nested, nested_comments, nested_comments, f"{indent}\t")


def nested_type(type_: str, code: str) -> str | None:
    """The message type that a line of a definition has a field of; primitive types have no capitals."""
    words = code.split()
    name = words[0].partition("[")[0] if words else ""
    package, _, message = name.rpartition("/")
    return f"{package or type_.partition('/')[0]}/msg/{message}" if message[:1].isupper() else None
