"""Suggest the name that a misspelt one was meant to be."""

import difflib
from collections.abc import Iterable


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """The end of an error about an unknown name: `` (did you mean 'period_s'?)``, empty if none is close.

    A name without its end, such as ``price`` or a key without its unit, means the shortest with any end.
    """
    names = sorted(known, key=len)
    longer = [each for each in names if each.startswith(f"{name}_")]
    close = longer or difflib.get_close_matches(name, names, n=1)
    return f" (did you mean '{close[0]}'?)" if close else ""
