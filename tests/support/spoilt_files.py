"""Files as users and disks spoil them: YAML with other values, texts with other bytes."""

import math
from collections.abc import Iterator
from random import Random
from typing import Any

VALUES: tuple[Any, ...] = (
    None, "", "text", "none", "../../outside", "/etc/passwd", "a\nb", "\x00", "ä" * 50, "9" * 400, "x" * 5000,
    [], {}, [[]], {"file": "none.yaml"}, {"kind": "none"}, {"kind": []}, {"": ""}, {"a": {"b": {"c": [1, 2]}}},
    0, -1, 1, 2, 7, 10**6, 10**30, -(10**30), 0.0, -0.0, 1e-300, -1.5, 0.5, 1e9, 1e300, -1e300,
    math.nan, math.inf, -math.inf, True, False, [0], [1.0, 2.0, 3.0], [math.nan] * 3, ["a", "b"],
)  # fmt: skip
"""What a user may write in place of a value."""
TEXTS = (
    "", "\t", ":", "- ", "{", "}", "[", "]", "&a *a", "*b", "<<: *c", "!!python/object/apply:os.system ['true']",
    "!!python/name:os.system", "!!binary aGk=", "!!set {a, b}", "!!timestamp 2001-01-01", "2001-01-01", "? x\n: y",
    "---\n", "...\n", "%YAML 3.0\n", "#", "'", '"', "|\n  text", "\x00", "\ufeff", "\x85", "0x1F", "1_000", "1:30",
    "~", "yes", "0o17", "@", "`", "key: 1\nkey: 2", "\r\n", "é", "\U0001f600", "a" * 3000,
)  # fmt: skip
"""What a user may write in the middle of a file."""


def places(tree: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths to all values of a tree but itself."""
    if isinstance(tree, dict | list):
        for key, value in tree.items() if isinstance(tree, dict) else enumerate(tree):
            yield (*path, key)
            yield from places(value, (*path, key))


def with_another_value(tree: Any, random: Random) -> None:
    """Replace, remove, repeat or rename something in a tree, in place."""
    *parents, last = random.choice(list(places(tree)))
    parent = tree
    for key in parents:
        parent = parent[key]
    kind = random.choice(("replace", "replace", "replace", "remove", "rename", "repeat", "swap"))
    if kind == "remove":
        del parent[last]
    elif kind == "rename" and isinstance(parent, dict):
        parent[str(random.choice((f"{last}_", str(last)[:-1], "file", "kind", "1")))] = parent.pop(last)
    elif kind == "repeat" and isinstance(parent, list):
        parent.extend([parent[last]] * random.choice((1, 40)))
    elif kind == "swap":
        other = tree
        for key in random.choice(list(places(tree))):
            other = other[key]
        parent[last] = other if not isinstance(other, dict | list) else random.choice(VALUES)
    else:
        parent[last] = random.choice(VALUES)


def with_other_bytes(content: bytes, random: Random) -> bytes:
    """Cut off, flip, insert, remove or repeat something in a file."""
    at = random.randint(0, len(content))
    until = min(len(content), at + random.choice((1, 4, 50, 5000)))
    match random.choice(("cut", "flip", "insert", "remove", "repeat", "zero")):
        case "cut":
            return content[:at]
        case "flip" if at < len(content):
            return content[:at] + bytes([content[at] ^ (1 << random.randrange(8))]) + content[at + 1 :]
        case "insert":
            return content[:at] + random.choice(TEXTS).encode() + content[at:]
        case "remove":
            return content[:at] + content[until:]
        case "zero":
            return content[:at] + bytes(until - at) + content[until:]
    return content[:until] + content[at:]
