"""JSON Schemas (draft 2020-12) of configuration files, from the schemas that check them on loading."""

import functools
from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel, TypeAdapter
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue

from relform_core.units import unit_of

JsonSchema = dict[str, Any]
Validated = type[BaseModel] | TypeAdapter[Any]
"""What pydantic validates by: a schema of a file, or an adapter of another type."""

_VALUES = ("const", "default", "enum", "examples", "required")
"""Keywords that hold values of a file."""


class _Generator(GenerateJsonSchema):
    """Keys in the order of their declaration, and without titles that repeat their names."""

    def sort(self, value: JsonSchemaValue, parent_key: str | None = None) -> JsonSchemaValue:
        """Keep the order."""
        return value

    def field_title_should_be_set(self, schema: Any) -> bool:
        """No title."""
        return False


@functools.cache
def json_schema(validated: Validated) -> JsonSchema:
    """The JSON Schema of what a file may hold, self-contained; not to be changed.

    Keys that end in a unit have it as ``x-unit``.
    """
    adapter = validated if isinstance(validated, TypeAdapter) else TypeAdapter(validated)
    generated = adapter.json_schema(schema_generator=_Generator)
    return {"$schema": _Generator.schema_dialect, **_tidy(generated)}


def keys_at(schema: JsonSchema, tree: Any, path: Sequence[str]) -> tuple[str, ...]:
    """The keys that a schema knows in the mapping at a path of a file.

    Args:
        tree: what the file holds; it decides which of several kinds of a section counts.
        path: keys and numbers of items that lead to the mapping.
    """
    nodes = _alternatives(schema, schema, tree)
    for part in path:
        tree = _child(tree, part)
        below = [child for node in nodes for child in _children(node, part)]
        nodes = [each for child in below for each in _alternatives(schema, child, tree)]
    return tuple(dict.fromkeys(key for node in nodes for key in node.get("properties", {})))


def resolved(schema: JsonSchema, node: JsonSchema) -> JsonSchema:
    """A part of a schema, or what it refers to."""
    reference: str | None = node.get("$ref")
    if reference is None:
        return node
    target: JsonSchema = schema["$defs"][reference.rpartition("/")[2]]
    return target


def _alternatives(schema: JsonSchema, node: JsonSchema, tree: Any) -> list[JsonSchema]:
    """The plain schemas that a value may satisfy; of sections with a kind, the one of the value's kind."""
    node = resolved(schema, node)
    if "properties" in node or not (choices := node.get("anyOf") or node.get("oneOf")):
        kind = node.get("properties", {}).get("kind", {}).get("const")
        is_other = kind is not None and isinstance(tree, dict) and tree.get("kind", kind) != kind
        return [] if is_other else [node]
    return [each for choice in choices for each in _alternatives(schema, choice, tree)]


def _children(node: JsonSchema, part: str) -> list[JsonSchema]:
    """The schemas of the value of a key, or of an item."""
    if part in (properties := node.get("properties", {})):
        return [properties[part]]
    return [each for each in (node.get("additionalProperties"), node.get("items")) if isinstance(each, dict)]


def _child(tree: Any, part: str) -> Any:
    if isinstance(tree, dict):
        return tree.get(part)
    return tree[int(part)] if isinstance(tree, list) and part.isdecimal() and int(part) < len(tree) else None


def _tidy(node: Any) -> Any:
    """Without names of classes, with one schema for all items of a vector, descriptions on one line."""
    if isinstance(node, list):
        return [_tidy(item) for item in node]
    if not isinstance(node, dict):
        return node
    tidy = {
        key: value if key in _VALUES else _tidy(value)
        for key, value in node.items()
        if not _is_noise(key, value)
    }
    items = tidy.get("prefixItems")
    if isinstance(items, list) and all(item == items[0] for item in items):
        # Editors that know only older drafts read this, too.
        tidy = {("items" if key == "prefixItems" else key): value for key, value in tidy.items()}
        tidy["items"] = items[0]
    if patterns := tidy.pop("patternProperties", None):
        # A pattern of names alone would let other names pass.
        ((pattern, value),) = patterns.items()
        tidy["propertyNames"] = {**tidy.get("propertyNames", {}), "pattern": pattern}
        tidy["additionalProperties"] = value
    if isinstance(text := tidy.get("description"), str):
        tidy["description"] = " ".join(text.split())
    if isinstance(properties := tidy.get("properties"), dict):
        if "kind" in properties:
            tidy["properties"] = properties = {"kind": properties["kind"], **properties}
        for key, value in properties.items():
            if isinstance(value, dict) and (unit := unit_of(key)) is not None:
                value["x-unit"] = unit
    return tidy


def _is_noise(key: str, value: Any) -> bool:
    """A title of a class, or a keyword of OpenAPI; a *property* of the same name is a mapping of its own."""
    return (key == "title" and isinstance(value, str)) or (key == "discriminator" and "propertyName" in value)
