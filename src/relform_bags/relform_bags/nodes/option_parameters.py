"""Options of a node from its parameters."""

from dataclasses import fields
from typing import TypeVar

from rclpy.node import Node

from relform_bags.options import DESCRIPTION, Options
from relform_ros.parameters import read_only

OptionsT = TypeVar("OptionsT", bound=Options)


def read_options(node: Node, kind: type[OptionsT]) -> OptionsT:
    """Declare a read-only parameter for each option, and read them all.

    Raises:
        ConfigError: a value has the wrong type.
        BagError: a value is out of its bounds.
    """
    defaults, values = kind(), {}
    for option in fields(kind):
        default, description = getattr(defaults, option.name), option.metadata[DESCRIPTION]
        if isinstance(default, tuple):  # an empty list has no type, so [""] stands for it
            texts = read_only(node, option.name, [*default] or [""], description)
            values[option.name] = tuple(text for text in texts if text)
        else:
            values[option.name] = read_only(node, option.name, default, description)
    return kind(**values)
