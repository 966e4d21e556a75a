"""Examples of keys and sections, made of those beside the fields of the schemas."""

from collections.abc import Mapping
from io import StringIO
from typing import Any

from ruamel.yaml import YAML

from relform_core.json_schema import JsonSchema, resolved


def example_of(root: JsonSchema, node: JsonSchema) -> Any:
    """A value of a key: the example beside its field, else its default, else one made of those below it.

    Args:
        root: the schema of the file.
        node: that of the key.
    Raises:
        LookupError: there is none.
    """
    if "examples" in node:
        return node["examples"][0]
    if node.get("default") is not None and not isinstance(node["default"], Mapping | list):
        return node["default"]
    node = resolved(root, node)
    match node:
        case {"const": value} | {"examples": [value, *_]} | {"enum": [value, *_]}:
            return value
        case {"properties": properties}:
            keys = _keys(node)
            return {key: example_of(root, value) for key, value in properties.items() if key in keys}
        case {"anyOf": [choice, *_]} | {"oneOf": [choice, *_]}:
            return example_of(root, choice)
        case {"type": "array", "items": items}:
            return [example_of(root, items)]
        case {"type": "object", "additionalProperties": value}:
            return {"initial": example_of(root, value)}
    raise LookupError(f"a field has neither an example nor a default: {node}")


def _keys(node: JsonSchema) -> set[str]:
    """The keys of an example: all that are required, or have an example or a value by default."""
    required = node.get("required", ())
    keys = {
        key
        for key, value in node["properties"].items()
        if not value.get("deprecated")
        and (key in required or "examples" in value or value.get("default") not in (None, []))
    }
    if "oneOf" in node:
        first = node["oneOf"][0]
        keys -= {key for key in node["properties"] if key not in (*required, *first["required"])}
        keys |= {*first["required"]}
    return keys


def yaml_line(value: Any) -> str:
    """A value as YAML on one line."""
    stream = StringIO()
    yaml: Any = YAML(typ="safe", pure=True)  # its attributes are typed as their defaults
    yaml.width = 10_000
    yaml.default_flow_style = True
    yaml.sort_base_mapping_type_on_output = False
    yaml.dump(value, stream)
    return stream.getvalue().removesuffix("...\n").strip()
