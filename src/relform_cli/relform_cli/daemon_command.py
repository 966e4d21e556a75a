"""The daemon of ros2cli, which this command does not have: its verbs exist for scripts that call them."""

from argparse import ArgumentParser, Namespace

from relform_cli.commands import VerbParsers


def add_arguments(parser: ArgumentParser) -> None:
    verbs = VerbParsers(parser)
    verb = verbs.add("start", start)
    verb.add_argument("-d", "--debug", action="store_true", help="accepted; there is no daemon")
    verbs.add("stop", report_not_running)
    verbs.add("status", report_not_running)


def start(_: Namespace) -> None:
    """Do nothing: each verb of this command discovers the graph itself."""
    print("No daemon is needed: each verb of this ros2 discovers the graph itself")


def report_not_running(_: Namespace) -> None:
    """Report that the daemon is not running."""
    print("The daemon is not running")
