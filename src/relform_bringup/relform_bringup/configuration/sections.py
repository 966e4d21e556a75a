"""The sections of a configuration file: mappings with keys of their own."""

import re
from dataclasses import dataclass

from relform_core.json_schema import JsonSchema, resolved


@dataclass
class Section:
    """A mapping, or several that differ in their ``kind``, at one place of a file or at several."""

    paths: list[str]
    description: str
    """Of the key that holds it."""
    members: list[JsonSchema]
    holder: str
    """Text before its members in YAML: of a list, of names, or nothing."""

    @property
    def heading(self) -> str:
        """As the page has it."""
        return " and ".join(f"`{path}`" for path in self.paths)

    @property
    def link(self) -> str:
        """To its heading, as code hosts make them."""
        return "#" + re.sub(r"[^\w -]", "", self.heading.lower()).replace(" ", "-")


def sections(root: JsonSchema, top: JsonSchema) -> list[Section]:
    """All sections of a file, each before those in it; one that several keys hold comes once.

    Args:
        root: the schema of the file.
        top: the part of it with the keys that come first.
    """
    found: list[Section] = []

    def visit(node: JsonSchema, path: str) -> None:
        for key, value in node.get("properties", {}).items():
            members = members_of(root, value)
            if is_file(value) or not any("properties" in member for member in members):
                continue
            where = f"{path}{key}"
            known = next((section for section in found if section.members == members), None)
            if known is not None:
                known.paths.append(where)
                continue
            found.append(Section([where], value.get("description", ""), members, _holder(value)))
            for member in members:
                visit(member, f"{where}.")

    visit(top, "")
    return found


def members_of(root: JsonSchema, node: JsonSchema) -> list[JsonSchema]:
    """The mappings that a value may be, or that its items may be."""
    node = resolved(root, node)
    if "properties" in node or (node.get("type") == "object" and "examples" in node):
        return [node]
    inner = [
        *node.get("anyOf", ()),
        *node.get("oneOf", ()),
        node.get("items"),
        node.get("additionalProperties"),
    ]
    return [member for each in inner if isinstance(each, dict) for member in members_of(root, each)]


def is_file(node: JsonSchema) -> bool:
    """Whether a section may be in a file of its own, which has its own part of the page."""
    return any("file" in choice.get("properties", {}) for choice in node.get("anyOf", ()))


def _holder(node: JsonSchema) -> str:
    if any(each.get("type") == "array" for each in (node, *node.get("anyOf", ()))):
        return "- "
    return "some_name: " if node.get("type") == "object" else ""
