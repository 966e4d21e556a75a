"""Definitions and hashes of message types, from the files that are installed with the types."""

import json
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, cast

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

from relform_core.errors import BagError

SEPARATOR = "=" * 80


@dataclass(frozen=True)
class MessageType:
    """What an MCAP file states about a message type."""

    name: str
    """For example ``std_msgs/msg/Header``."""
    definition: str
    """The .msg text and those of all types that it contains (encoding ``ros2msg``)."""
    type_hash: str
    """RIHS01 hash of REP-2011."""


@cache
def message_type(name: str) -> MessageType:
    """Definition of an installed message type.

    Raises:
        BagError: the type is not installed, or has no .msg file.
    """
    description = json.loads(_read_definition(name, "json"))
    needed = description["type_description_msg"]["referenced_type_descriptions"]
    definition = _read_definition(name, "msg")
    for dependency in (entry["type_name"] for entry in needed):
        package, _, short_name = dependency.split("/")
        text = _read_definition(dependency, "msg")
        definition += f"\n{SEPARATOR}\nMSG: {package}/{short_name}\n{text}"
    hashes = {entry["type_name"]: entry["hash_string"] for entry in description["type_hashes"]}
    return MessageType(name, definition, hashes[name])


@cache
def message_class(name: str) -> type[Any]:
    """Python class of an installed message type.

    Raises:
        BagError: the type is not installed, or the name is not that of a type.
    """
    package, short_name = _package_and_name(name)
    try:
        return cast(type[Any], getattr(import_module(f"{package}.msg"), short_name))
    except (ImportError, AttributeError):
        raise BagError(f"message type '{name}' is not installed, or its setup file not sourced") from None


def _package_and_name(name: str) -> tuple[str, str]:
    """``std_msgs`` and ``Header`` of ``std_msgs/msg/Header``."""
    match name.split("/"):
        case [package, _, short_name] if package:
            return package, short_name
    raise BagError(f"'{name}' is not the name of a ROS 2 message type")


def _read_definition(name: str, extension: str) -> str:
    package, short_name = _package_and_name(name)
    try:
        path = Path(get_package_share_directory(package), "msg", f"{short_name}.{extension}")
        return path.read_text(encoding="utf-8")
    except PackageNotFoundError:
        raise BagError(
            f"message type '{name}': package '{package}' is not installed, or its setup file not sourced"
        ) from None
    except OSError:
        raise BagError(f"message type '{name}': no such file: {path}") from None
