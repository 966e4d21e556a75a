"""Interface types by name: classes, definitions and lists."""

import importlib
from pathlib import Path
from typing import Any

from ament_index_python import get_resource, get_resources, has_resource

from relform_cli.errors import CommandError

KINDS = {"msg": "Messages", "srv": "Services", "action": "Actions"}

EXAMPLES = {"msg": "std_msgs/msg/String", "srv": "std_srvs/srv/Trigger"}

_INDEX = "rosidl_interfaces"


def message_class(name: str) -> Any:
    """The class of a message type such as "std_msgs/msg/String" or "std_msgs/String".

    Raises:
        CommandError: no such type.
    """
    return _interface_class(name, "msg", "message", ("SLOT_TYPES",))


def service_class(name: str) -> Any:
    """The class of a service type such as "std_srvs/srv/Trigger" or "std_srvs/Trigger".

    Raises:
        CommandError: no such type.
    """
    return _interface_class(name, "srv", "service", ("Request", "Response"))


def _interface_class(name: str, kind: str, word: str, attributes: tuple[str, ...]) -> Any:
    package, _, rest = name.partition("/")
    type_ = rest.removeprefix(f"{kind}/")
    try:
        if package.isidentifier() and type_.isidentifier():
            found = getattr(importlib.import_module(f"{package}.{kind}"), type_)
            if all(hasattr(found, attribute) for attribute in attributes):
                return found
    except (ModuleNotFoundError, AttributeError):
        pass
    raise CommandError(
        f"The passed {word} type is invalid: '{name}'; "
        f"an example is {EXAMPLES[kind]}, ros2 interface list shows all"
    )


def interface_packages() -> list[str]:
    return sorted(get_resources(_INDEX))


def interfaces(package: str, *kinds: str) -> list[str]:
    """The types of a package, such as "msg/String", sorted; of all kinds if none is given.

    Raises:
        CommandError: no such package.
    """
    if not package or not has_resource("packages", package):
        raise CommandError(f"Unknown package '{package}'")
    if not has_resource(_INDEX, package):
        return []
    files = map(Path, get_resource(_INDEX, package)[0].splitlines())
    # Names with an underscore are parts that services and actions generate.
    names = {path.with_suffix("") for path in files if "_" not in path.name}
    return sorted(str(name) for name in names if name.parent.name in (kinds or KINDS))


def all_interfaces(*kinds: str) -> list[str]:
    """The types of all packages, such as "std_msgs/msg/String", sorted."""
    return [f"{package}/{name}" for package in interface_packages() for name in interfaces(package, *kinds)]


def definition(name: str) -> Path:
    """The file that defines an interface.

    Raises:
        CommandError: no such type.
    """
    if name.count("/") != 2 or not all(name.split("/")) or ".." in name:
        raise CommandError(f"Invalid name '{name}'. Expected three parts separated by '/'")
    package, kind, _ = name.split("/")
    prefix = has_resource("packages", package)
    if not prefix:
        raise CommandError(f"Unknown package '{package}'")
    path = Path(prefix, "share", name)
    for candidate in (Path(f"{path}.{kind}"), Path(f"{path}.idl")):
        if candidate.exists():
            return candidate
    raise CommandError(f"Could not find the interface '{path}.idl'")
