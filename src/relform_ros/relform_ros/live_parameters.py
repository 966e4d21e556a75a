"""Parameters that may be changed in flight: accepted at any time, applied by the node between two steps."""

import sys
from collections.abc import Iterable, Mapping
from typing import Any, Generic, TypeVar

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.node import Node
from rclpy.parameter import Parameter

from relform_core.errors import ConfigError
from relform_core.live_values import LiveValue, LiveValues, Value
from relform_ros.parameters import declare, doubles

T = TypeVar("T", bound=LiveValues)


class LiveParameters(Generic[T]):
    """``LiveValues`` as parameters of a node.

    The parameters have an accepted value immediately; the node applies it when it calls ``take``.

    Args:
        live: what may be changed; the values that the node is started with are the first change.
    Raises:
        ConfigError: one line: the node is started with a value that cannot be used.
    """

    def __init__(self, node: Node, live: T) -> None:
        self.live = live
        """With all changes accepted so far."""
        self._node = node
        self._accepted: dict[str, Value] = {}
        self._closed = False
        self._showing = False
        given = {
            key: _value(declare(node, key, _ros_value(value), _descriptor(live.described[key])))
            for key, value in live.values.items()
        }
        self._accept({key: value for key, value in given.items() if value != live.values[key]})
        node.add_pre_set_parameters_callback(self._before_set)
        node.add_on_set_parameters_callback(self._on_set)
        node.add_post_set_parameters_callback(self._on_was_set)

    def take(self) -> Mapping[str, Value]:
        """The changes accepted since the last call, to be applied now."""
        accepted, self._accepted = self._accepted, {}
        return accepted

    def change(self, changes: Mapping[str, Value]) -> None:
        """Accept changes that did not come by the parameter services.

        Raises:
            ConfigError: one line: a key, what it must be, what it is.
        """
        self._check_open()
        self._accept(changes)
        self._show(changes)

    def follow(self, values: Mapping[str, Value]) -> None:
        """Set the parameters to values that already hold for another reason; there is nothing to apply."""
        changes = {key: value for key, value in values.items() if value != self.live.values[key]}
        if changes:
            self.live = self.live.changed(changes)
            self._show(changes)

    def close(self) -> None:
        """Refuse all changes from now on, because nothing would apply them."""
        self._closed = True

    def _check_open(self) -> None:
        if self._closed:
            raise ConfigError("the flight is over")

    def _accept(self, changes: Mapping[str, Value]) -> None:
        self.live = self.live.changed(changes)
        self._accepted |= changes

    def _show(self, values: Mapping[str, Value]) -> None:
        self._showing = True
        try:
            self._node.set_parameters_atomically(
                [Parameter(key, value=_ros_value(value)) for key, value in values.items()]
            )
        finally:
            self._showing = False

    def _own(self, parameters: Iterable[Parameter]) -> dict[str, Value]:
        return {each.name: _value(each.value) for each in parameters if each.name in self.live.described}

    # rclpy calls these in order: amend a change, accept or refuse it as a whole, report that it was made.

    def _before_set(self, parameters: list[Parameter]) -> list[Parameter]:
        unknown = [each.name for each in parameters if not self._node.has_parameter(each.name)]
        if unknown:  # rclpy would refuse them as well, but omits the first name
            raise ParameterNotDeclaredException(unknown)
        return [
            Parameter(each.name, value=doubles(each.value)) if each.name in self.live.described else each
            for each in parameters
        ]

    def _on_set(self, parameters: list[Parameter]) -> SetParametersResult:
        changes = self._own(parameters)
        if changes and not self._showing:
            try:
                self._check_open()
                self.live.changed(changes)
            except ConfigError as error:
                return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _on_was_set(self, parameters: list[Parameter]) -> None:
        changes = self._own(parameters)
        if changes and not self._showing:
            self._accept(changes)


def _descriptor(value: LiveValue) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(description=value.description, additional_constraints=value.constraint)
    if value.bounded:
        # One-sided ranges do not exist in ROS.
        greatest = sys.float_info.max
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=max(value.lowest, -greatest), to_value=min(value.highest, greatest))
        ]
    return descriptor


def _ros_value(value: Value) -> float | list[float]:
    return list(value) if isinstance(value, tuple) else value


def _value(value: Any) -> Value:
    return value if isinstance(value, float) else tuple(value)
