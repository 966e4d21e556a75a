"""Suggest the name that a misspelt one was meant to be."""

import difflib
from collections.abc import Iterable
from pathlib import Path


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """The end of an error about an unknown name: `` (did you mean 'period_s'?)``, empty if none is close.

    A name without its end, such as ``price`` or a key without its unit, means the shortest with any end.
    """
    names = sorted(known, key=len)
    longer = [each for each in names if each.startswith(f"{name}_")]
    close = longer or difflib.get_close_matches(name, names, n=1)
    return f" (did you mean '{close[0]}'?)" if close else ""


def path_meant(path: Path) -> str:
    """The same about a path that does not exist, from the names beside it with the same suffix."""
    try:
        beside = [each.name for each in path.parent.iterdir() if each.suffix == path.suffix]
    except OSError:
        return ""
    return did_you_mean(path.name, beside)
