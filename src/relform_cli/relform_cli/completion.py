"""Completers of arguments, which argcomplete calls."""

from argparse import Action
from collections.abc import Callable, Iterable


def completed_by(completer: Callable[..., Iterable[str]], argument: Action) -> None:
    """Complete an argument by a function that takes the keyword arguments of argcomplete."""
    argument.completer = completer  # type: ignore[attr-defined]  # where argcomplete looks for it
