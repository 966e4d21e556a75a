"""Explain the problems of a configuration, one line each: the key, its requirement, its value."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from relform_core.json_schema import Validated, json_schema, keys_at
from relform_core.suggestions import did_you_mean

KeyPath = tuple[str, ...]

_REQUIREMENTS = {
    "bool_type": "be true or false",
    "dict_type": "be a mapping of keys to values",
    "finite_number": "be a finite number",
    "float_type": "be a number",
    "greater_than": "be greater than {gt}",
    "greater_than_equal": "be greater than or equal to {ge}",
    "int_from_float": "be a whole number",
    "int_type": "be a whole number",
    "less_than": "be less than {lt}",
    "less_than_equal": "be less than or equal to {le}",
    "literal_error": "be {expected}",
    "model_attributes_type": "be a mapping of keys to values",
    "model_type": "be a mapping of keys to values",
    "string_pattern_mismatch": "match pattern '{pattern}'",
    "string_too_long": "have at most {max_length} characters",
    "string_too_short": "have at least {min_length} characters",
    "string_type": "be text",
    "too_long": "have at most {max_length} item(s)",
    "too_short": "have at least {min_length} item(s)",
    "tuple_type": "be a list",
}
"""What a value must do, by pydantic's type of error; the braces are keys of its context."""


LINE_MAX = 400
"""Characters of an explanation."""


@dataclass
class Origins:
    """Where the parts of a configuration were written."""

    scenario: str
    """Path of the scenario file; empty: no file, a key is located by its name alone."""
    files: dict[str, str] = field(default_factory=dict)
    """Path of the file of each section that is in a file."""
    in_scenario: set[KeyPath] = field(default_factory=set)
    """Keys of these sections that the scenario replaces."""
    overrides: set[KeyPath] = field(default_factory=set)
    """Keys that were set on the command line."""

    def is_override(self, key: KeyPath) -> bool:
        """Whether a key, or one above it, was set on the command line."""
        return any(key[: len(override)] == override for override in self.overrides)

    def locate(self, key: KeyPath) -> str:
        """Where to look for a key: its file or ``--set``, and its name there."""
        if self.is_override(key):
            return f"--set {'.'.join(key)}"
        if key and key[0] in self.files and key[:2] not in self.in_scenario:
            file, key = self.files[key[0]], key[1:]
        else:
            file = self.scenario
        return ": ".join(filter(None, (file, ".".join(key))))

    def locate_contradiction(self, key: KeyPath) -> str:
        """Where to look for values below a key that contradict each other; some may be overrides."""
        below = [f"--set {'.'.join(each)}" for each in self.overrides if each[: len(key)] == key != each]
        return " with ".join([self.locate(key), *([", ".join(sorted(below))] if below else [])])


def explain(error: ValidationError, tree: Mapping[str, Any], origins: Origins, schema: Validated) -> str:
    """One line for each problem that the validation found.

    Args:
        error: of the validation.
        tree: what was validated.
        origins: of its keys.
        schema: what it was validated by; its keys are suggested for misspelt ones.
    """
    problems = [details for details in error.errors() if not _is_consequence(details)]
    return "\n".join(_readable(_line(details, tree, origins, schema)) for details in problems)


def _readable(line: str) -> str:
    """A line that may quote any text, with escapes for what cannot be printed, and not too long."""
    line = "".join(each if each.isprintable() else repr(each)[1:-1] for each in line)
    return line if len(line) <= LINE_MAX else f"{line[: LINE_MAX - 3]}..."


def _is_consequence(details: ErrorDetails) -> bool:
    """Whether a list is called too short only because its items are bad, which is another problem."""
    return details["type"] == "too_short" and len(details["input"]) >= details["ctx"]["min_length"]


def _line(details: ErrorDetails, tree: Mapping[str, Any], origins: Origins, schema: Validated) -> str:
    key = _written_path(details["loc"], tree)
    if details["type"] in ("union_tag_invalid", "union_tag_not_found"):
        key = (*key, "kind")
    where = origins.locate(key)
    match details["type"]:
        case "extra_forbidden":
            return (
                f"{where}: unknown key{did_you_mean(key[-1], keys_at(json_schema(schema), tree, key[:-1]))}"
            )
        case "missing":
            return f"{where}: missing {'item' if isinstance(details['loc'][-1], int) else 'key'}"
        case "value_error":
            return f"{origins.locate_contradiction(key)}: {details['ctx']['error']}"
        case "union_tag_invalid":
            expected, tag = details["ctx"]["expected_tags"], details["ctx"]["tag"]
            return f"{where}: must be one of {expected} (got '{tag}'){_meant(tag, expected)}"
        case "union_tag_not_found":
            return f"{where}: missing key"
        case type_ if type_ in _REQUIREMENTS:
            context = {name: _number(value) for name, value in details.get("ctx", {}).items()}
            requirement = _REQUIREMENTS[type_].format_map(context)
            suggestion = _meant(details["input"], context.get("expected", ""))
            return f"{where}: must {requirement} (got {_shown(details['input'])}){suggestion}"
        case _:
            return f"{where}: {details['msg']} (got {_shown(details['input'])})"


def _meant(value: Any, expected: str) -> str:
    """A suggestion for a text, from a list of quoted ones."""
    return did_you_mean(value, re.findall(r"'([^']*)'", expected)) if isinstance(value, str) else ""


def _number(value: Any) -> Any:
    """A bound as people write it: 0, not 0.0."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _written_path(location: tuple[int | str, ...], tree: Mapping[str, Any]) -> KeyPath:
    """The path of a key in the file, without the tags of unions and '[key]' that the validation adds."""
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
