"""What is wrong with a configuration, one line per problem: which key, what it must be, what it is."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

KeyPath = tuple[str, ...]

_EXPECTED = {
    "dict_type": "a mapping of keys to values",
    "float_type": "a number",
    "int_from_float": "a whole number",
    "int_type": "a whole number",
    "model_type": "a mapping of keys to values",
    "string_type": "text",
    "tuple_type": "a list",
}
"""The types of values as someone who writes YAML calls them."""


@dataclass
class Origins:
    """Where the parts of a configuration were written."""

    scenario: str
    """Path of the scenario file; empty: there is none, and a key is located by its name alone."""
    files: dict[str, str] = field(default_factory=dict)
    """Path of the file of each section that has one."""
    overrides: set[KeyPath] = field(default_factory=set)
    """Keys that were set on the command line."""

    def locate(self, key: KeyPath) -> str:
        """Where to look for a key, in the words of the one who wrote it."""
        if any(key[: len(override)] == override for override in self.overrides):
            return f"--set {'.'.join(key)}"
        if key and key[0] in self.files:
            file, key = self.files[key[0]], key[1:]
        else:
            file = self.scenario
        return ": ".join(filter(None, (file, ".".join(key))))


def explain(error: ValidationError, tree: Mapping[str, Any], origins: Origins) -> str:
    """One line for each problem that the validation found in ``tree``."""
    problems = [details for details in error.errors() if not _is_consequence(details)]
    return "\n".join(_line(details, tree, origins) for details in problems)


def _is_consequence(details: ErrorDetails) -> bool:
    """Whether a list was called too short only because its items are bad, which is told already."""
    return details["type"] == "too_short" and len(details["input"]) >= details["ctx"]["min_length"]


def _line(details: ErrorDetails, tree: Mapping[str, Any], origins: Origins) -> str:
    key = _written_path(details["loc"], tree)
    if details["type"] in ("union_tag_invalid", "union_tag_not_found"):
        key = (*key, "kind")
    where = origins.locate(key)
    match details["type"]:
        case "extra_forbidden":
            return f"{where}: unknown key"
        case "missing":
            return f"{where}: missing {'item' if isinstance(details['loc'][-1], int) else 'key'}"
        case "value_error":
            return f"{where}: {details['ctx']['error']}"
        case "union_tag_invalid":
            return (
                f"{where}: must be one of {details['ctx']['expected_tags']} (got '{details['ctx']['tag']}')"
            )
        case "union_tag_not_found":
            return f"{where}: missing key"
        case "too_short":
            requirement = f"have at least {details['ctx']['min_length']} item(s)"
        case "too_long":
            requirement = f"have at most {details['ctx']['max_length']} item(s)"
        case expected if expected in _EXPECTED:
            requirement = f"be {_EXPECTED[expected]}"
        case _:
            _, _, requirement = details["msg"].rpartition(" should ")
    return f"{where}: must {requirement} (got {_shown(details['input'])})"


def _written_path(location: tuple[int | str, ...], tree: Mapping[str, Any]) -> KeyPath:
    """The path of a key without what the validation adds: the tag of a union, and '[key]'."""
    path: list[str] = []
    node: Any = tree
    for part in location:
        if part == "[key]" or (isinstance(node, Mapping) and node.get("kind") == part):
            continue
        path.append(str(part))
        if isinstance(node, Mapping):
            node = node.get(part)
        elif isinstance(node, list) and isinstance(part, int) and part < len(node):
            node = node[part]
        else:
            node = None
    return tuple(path)


def _shown(value: Any) -> str:
    text = "nothing" if value is None else repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
