"""The values that a key takes, in words, from its JSON Schema."""

from collections.abc import Mapping

from relform_core.json_schema import JsonSchema, resolved


def in_words(root: JsonSchema, node: JsonSchema, unit: str | None, section: str) -> str:
    """What values a key takes: type, bounds and unit.

    Args:
        root: the schema of the file.
        node: that of the key.
        unit: of the key.
        section: link to the section with the keys of a mapping, or of the mappings in a list.
    """
    node = resolved(root, node)
    choices = node.get("anyOf") or node.get("oneOf")
    if choices and "properties" not in node:
        parts = [part for choice in choices for part in _choices(root, choice, unit, section)]
        return _listed(list(dict.fromkeys(parts)))
    return _listed(_choices(root, node, unit, section))


def _choices(root: JsonSchema, node: JsonSchema, unit: str | None, section: str) -> list[str]:
    """The kinds of values, one or several."""
    node = resolved(root, node)
    match node:
        case {"const": value}:
            return [f"`{value}`"]
        case {"enum": values}:
            return [f"`{value}`" for value in values]
        case {"properties": _} | {"anyOf": _} | {"oneOf": _}:
            return [f"[keys]({section})"]
        case {"type": "array"}:
            return [_array(root, node, unit, section)]
        case {"type": "object"}:
            return [f"[keys]({section})" if section else "keys"]
        case {"type": "number" | "integer"}:
            return [_number(node, unit)]
        case {"type": "boolean"}:
            return ["true", "false"]
        case {"type": "string"}:
            return [_text(node)]
        case {"type": str(name)}:
            return [name]
    return ["any value"]


def _listed(texts: list[str]) -> str:
    return " or ".join(filter(None, (", ".join(texts[:-1]), *texts[-1:])))


def _array(root: JsonSchema, node: JsonSchema, unit: str | None, section: str) -> str:
    items = resolved(root, node["items"])
    least, most = node.get("minItems"), node.get("maxItems")
    match items:
        case {"type": "number"}:
            bounds = _bounds(items)
            what = f"numbers, {bounds} {unit or ''}".rstrip() if bounds else _in_unit("numbers", unit)
        case {"type": "string"}:
            what = "names" if _text(items) == "name" else "texts"
        case {"type": "array"}:
            what = f"lists of {_array(root, items, unit, section)}"
        case {"type": _} | {"oneOf": _} | {"properties": _}:
            return f"[list]({section}), at least {least}" if least else f"[list]({section})"
        case _:
            what = "values"
    if least is not None and least == most:
        return f"{least} {what}"
    if least is None:
        return f"list of {what}"
    return f"{least} to {most} {what}" if most is not None else f"list of {what}, at least {least}"


def _number(node: JsonSchema, unit: str | None) -> str:
    if "not" in node:
        least, most = node["not"]["exclusiveMaximum"], node.get("maximum")
        between = f"≥ {least:.10g}" if most is None else f"{least:.10g} to {most:.10g}"
        return f"{between} {unit or ''}".rstrip() + " in magnitude"
    bounds = _bounds(node)
    if node["type"] == "integer":
        return f"whole number {bounds}".rstrip()
    return f"{bounds} {unit or ''}".rstrip() if bounds else _in_unit("number", unit)


def _in_unit(what: str, unit: str | None) -> str:
    return what if unit is None else f"{what} in {unit}"


def _bounds(node: Mapping[str, float]) -> str:
    if "minimum" in node and "maximum" in node:
        return f"{node['minimum']:.10g} to {node['maximum']:.10g}"
    signs = {"exclusiveMinimum": ">", "minimum": "≥", "exclusiveMaximum": "<", "maximum": "≤"}
    return ", ".join(f"{sign} {node[key]:.10g}" for key, sign in signs.items() if key in node)


def _text(node: JsonSchema) -> str:
    """``name`` is explained at the beginning of the page."""
    if node.get("pattern", "").startswith("^[a-z]"):
        return "name"
    return f"text, at most {node['maxLength']} characters" if "maxLength" in node else "text"
