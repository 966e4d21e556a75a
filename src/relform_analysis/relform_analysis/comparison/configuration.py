"""What differs in the configurations of flights, key by key, and in their software."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from relform_analysis.comparison.flights import ComparedFlight

NOT_SET = "not set"
NOT_RECORDED = "not recorded"
OWN_SECTIONS = ("controller", "vehicle", "sensors", "events")
"""Keys of a scenario that are sections of a comparison; all others are in the section ``scenario``."""
_ABSENT: Any = object()


@dataclass(frozen=True)
class Difference:
    """One key that not all flights have with the same value."""

    section: str
    """``scenario``, ``controller``, ``vehicle``, ``sensors``, ``events``, ``seed`` or ``software``."""
    key: str
    """Its path, as ``--set`` takes it."""
    values: tuple[str, ...]
    """By flight, in the words of a configuration file."""


def configuration_differences(flights: Sequence[ComparedFlight]) -> list[Difference]:
    """Every difference, by section; none: the same flight, as far as its configuration tells."""
    written = [flight.log.scenario.written for flight in flights]
    found = {section: list[Difference]() for section in ("scenario", *OWN_SECTIONS)}
    for path, values in _differences((), written):
        section = path[0] if path[0] in OWN_SECTIONS else "scenario"
        found[section].append(Difference(section, ".".join(path), tuple(map(_text, values))))
    seeds = [str(flight.log.scenario.seed) for flight in flights]
    if len(set(seeds)) > 1:
        found["seed"] = [Difference("seed", "seed", tuple(seeds))]
    found["software"] = _software_differences([flight.summary["versions"] for flight in flights])
    return [difference for differences in found.values() for difference in differences]


def _software_differences(versions: Sequence[Mapping[str, str | None]]) -> list[Difference]:
    if any(versions) and not all(versions):
        return [
            Difference(
                "software", "software", tuple("recorded" if each else NOT_RECORDED for each in versions)
            )
        ]
    names = dict.fromkeys(name for each in versions for name in each)
    texts = {
        name: tuple(each.get(name, NOT_RECORDED) or "not installed" for each in versions) for name in names
    }
    return [Difference("software", name, values) for name, values in texts.items() if len(set(values)) > 1]


def _differences(path: tuple[str, ...], nodes: Sequence[Any]) -> Iterator[tuple[tuple[str, ...], list[Any]]]:
    """Paths under a path at which the nodes of the flights differ, with these nodes."""
    by_name = [_by_name(node) for node in nodes]
    if all(isinstance(node, Mapping) for node in by_name):
        for key in dict.fromkeys(key for node in by_name for key in node):
            yield from _differences((*path, str(key)), [node.get(key, _ABSENT) for node in by_name])
    elif any(_is_other(node, nodes[0]) for node in nodes[1:]):
        yield path, list(nodes)


def _by_name(node: Any) -> Any:
    """A list of sections as a mapping, by the name of each section, else by its number."""
    if not isinstance(node, list) or not all(isinstance(item, Mapping) for item in node):
        return node
    return {str(item.get("name", number)): item for number, item in enumerate(node)}


def _is_other(first: Any, second: Any) -> bool:
    """Whether two nodes differ; a key that is not set is like an empty one."""
    nothing = [node is _ABSENT or node in ([], {}, None) for node in (first, second)]
    return not all(nothing) and (any(nothing) or bool(first != second))


def _text(value: Any) -> str:
    """A node in one line, as in a configuration file."""
    match value:
        case Mapping():
            return "{" + ", ".join(f"{key}: {_text(each)}" for key, each in value.items()) + "}"
        case list() | tuple():
            return "[" + ", ".join(map(_text, value)) + "]"
        case None:
            return "null"
        case bool():
            return str(value).lower()
        case float():
            return f"{value:g}" if float(f"{value:g}") == value else repr(value)
        case _:
            return NOT_SET if value is _ABSENT else str(value)
