"""Attaching completers, which argcomplete calls, to arguments."""

from argparse import Action
from collections.abc import Callable, Iterable


def completed_by(completer: Callable[..., Iterable[str]], argument: Action) -> None:
    """Let an argument be completed by a function with the keyword arguments of argcomplete's completers."""
    argument.completer = completer  # type: ignore[attr-defined]  # where argcomplete looks for it
