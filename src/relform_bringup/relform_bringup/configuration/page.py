"""The page docs/configuration.md: every key of every configuration file."""

import textwrap
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from relform_bringup.configuration.examples import example_of, yaml_line
from relform_bringup.configuration.file_kinds import FILE_KINDS, SCHEMA_FOLDER, FileKind
from relform_bringup.configuration.sections import Section, is_file, members_of, sections
from relform_bringup.configuration.words import in_words
from relform_core.json_schema import JsonSchema, resolved

_BEGIN = "<!-- scripts/configuration.py writes the rest -->"
_WIDTH = 150
_CELL_MAX = 50
"""Longest line of YAML in a table; the example above the table has longer ones."""
_EXAMPLE_MAX = 86
"""Longest line of YAML outside of tables."""


def page_text(before: str, config: Path) -> str:
    """The page.

    Args:
        before: the page as it is; what stands before the generated part stays.
        config: folder with the shipped files.
    """
    introduction = before.partition(_BEGIN)[0]
    headings: set[str] = set()
    blocks = [block for kind in FILE_KINDS for block in _file(kind, config, headings)]
    return "\n\n".join([f"{introduction}{_BEGIN}", *filter(None, blocks)]) + "\n"


def _file(kind: FileKind, config: Path, headings: set[str]) -> Iterator[str]:
    """The part on one kind of file, without sections that earlier parts have; ``headings`` gets its own."""
    root = kind.json_schema
    path = "/".join(filter(None, ("config", kind.folder, f"{kind.example}.yaml")))
    schema = f"config/{SCHEMA_FOLDER}/{kind.name}.json"
    shipped = ", ".join(f"[{file.stem}](../config/{file.relative_to(config)})" for file in kind.files(config))
    yield f"## {kind.title}"
    yield _filled(kind.intro)
    yield _filled(f"In `{path.rpartition('/')[0]}`: {shipped}. JSON Schema: [{schema}](../{schema}).")
    yield _yaml((config.parent / path).read_text().strip())
    found = sections(root, kind.top)
    yield _table(root, kind.top, kind.top["properties"], found)
    for section in found:
        if section.heading not in headings:
            headings.add(section.heading)
            yield from _section(root, section, found)


def _section(root: JsonSchema, section: Section, found: list[Section]) -> Iterator[str]:
    yield f"### {section.heading}"
    if len(section.members) == 1:
        (member,) = section.members
        yield _filled(_prose(root, member))
        yield _yaml(_example(root, section, member))
        yield _table(root, member, member["properties"], found)
        return
    yield _filled(section.description.replace("``", "`"))
    kinds = [member for member in section.members if _properties(member)]
    shared = _shared(kinds)
    if shared:
        yield "All kinds have these keys:"
        yield _table(root, kinds[0], shared, found)
    described: dict[str, str] = {}
    for member in section.members:
        own = {key: value for key, value in _properties(member).items() if key not in (*shared, "kind")}
        kind = _properties(member).get("kind")
        name = "" if kind is None else f"`{kind['const']}`"
        if kind is not None and not own:
            yield _filled(f"**{name}**: {_prose(root, member)} `{yaml_line(example_of(root, member))}`")
            continue
        yield _filled(f"**{name}**: {_prose(root, member)}" if name else _prose(root, member))
        yield _yaml(_example(root, section, member))
        if own and (table := _table(root, member, own, found)) in described:
            yield f"Its keys are those of {described[table]}."
        elif own:
            described[table] = name
            yield table


def _properties(node: JsonSchema) -> dict[str, JsonSchema]:
    """By key; empty for a mapping with keys of the user's choice."""
    properties: dict[str, JsonSchema] = node.get("properties", {})
    return properties


def _shared(members: list[JsonSchema]) -> dict[str, JsonSchema]:
    """Keys that all kinds have alike."""
    return {
        key: value
        for key, value in members[0]["properties"].items()
        if all(member["properties"].get(key) == value for member in members)
    }


def _example(root: JsonSchema, section: Section, member: JsonSchema) -> str:
    """The section as a file has it: key by key where it is long."""
    value = example_of(root, member)
    key = f"{section.paths[0].rpartition('.')[2]}:"
    holder = section.holder
    if len(line := f"{holder}{yaml_line(value)}") > _EXAMPLE_MAX:
        lines = [f"{name}: {yaml_line(each)}" for name, each in value.items()]
        if holder == "- ":
            return "\n".join([key, f"  - {lines[0]}", *(f"    {each}" for each in lines[1:])])
        return "\n".join([key, *(f"  {each}" for each in lines)])
    return f"{key}\n  {line}" if holder else f"{key} {line}"


def _table(
    root: JsonSchema, node: JsonSchema, properties: Mapping[str, JsonSchema], found: list[Section]
) -> str:
    rows = ["| key | value | default | meaning |", "|---|---|---|---|"]
    for key, value in properties.items():
        line = f"{key}: {yaml_line(example_of(root, value))}"
        cells = (
            f"`{line if len(line) <= _CELL_MAX else f'{key}: ...'}`",
            _words(root, key, value, found),
            _default(node, key, value),
            _prose(root, value),
        )
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows)


def _words(root: JsonSchema, key: str, value: JsonSchema, found: list[Section]) -> str:
    if is_file(value):
        return f"file or [keys](#{key}-files)"
    members = members_of(root, value)
    link = next((section.link for section in found if section.members == members), "")
    return in_words(root, value, value.get("x-unit"), link)


def _default(node: JsonSchema, key: str, value: JsonSchema) -> str:
    """The default of a key, whether it is required, or what may stand in its place."""
    if key in node.get("required", ()):
        return "required"
    options = [option["required"] for option in node.get("oneOf", ())]
    if others := [f"`{name}`" for option in options if key not in option for name in option]:
        return f"or {', '.join(others)}" if any(key in option for option in options) else "`null`"
    if "default" not in value:
        return "unchanged"  # the file changes some values of another one
    default: Any = value["default"]
    if isinstance(default, Mapping):
        return f"`{default['kind']}`" if default.keys() == {"kind"} else "those of its keys"
    return f"`{'null' if default is None else yaml_line(default)}`"


def _prose(root: JsonSchema, node: JsonSchema) -> str:
    """The meaning of a key, or that of what it holds."""
    text: str = node.get("description") or resolved(root, node).get("description", "")
    return text.replace("``", "`")


def _filled(text: str) -> str:
    return textwrap.fill(text, _WIDTH, break_long_words=False, break_on_hyphens=False)


def _yaml(text: str) -> str:
    return f"```yaml\n{text}\n```"
