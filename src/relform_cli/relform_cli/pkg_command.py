"""Installed packages, their executables and their folders."""

from argparse import ArgumentParser, Namespace

from relform_cli.commands import VerbParsers
from relform_cli.completion import completed_by
from relform_cli.errors import CommandError
from relform_cli.packages import complete_package, executables, package_names, package_prefix


def add_arguments(parser: ArgumentParser) -> None:
    verbs = VerbParsers(parser)
    verbs.add("list", list_packages)

    verb = verbs.add("executables", list_executables)
    completed_by(complete_package, verb.add_argument("package_name", nargs="?", help="default: all packages"))
    verb.add_argument("--full-path", action="store_true", help="show the path of each executable")

    verb = verbs.add("prefix", print_prefix)
    completed_by(complete_package, verb.add_argument("package_name"))
    verb.add_argument("--share", action="store_true", help="show the package's share folder")


def list_packages(_: Namespace) -> None:
    """List the packages."""
    print(*package_names(), sep="\n")


def list_executables(arguments: Namespace) -> None:
    """List the executables of a package."""
    for package in [arguments.package_name] if arguments.package_name else package_names():
        for path in executables(package):
            print(path if arguments.full_path else f"{package} {path.name}")


def print_prefix(arguments: Namespace) -> None:
    """Print the folder that a package is installed in."""
    package = arguments.package_name
    try:
        prefix = package_prefix(package)
    except CommandError:
        raise CommandError("Package not found") from None
    print(prefix / "share" / package if arguments.share else prefix)
