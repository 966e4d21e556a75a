"""A client of the parameter services of one node, like ``ros2 param``."""

from collections.abc import Mapping
from typing import Any

from rcl_interfaces.msg import Parameter as ParameterMsg
from rcl_interfaces.msg import ParameterDescriptor
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.parameter import Parameter, parameter_value_to_python

from support.observer import Observer


class ParameterClient:
    """Calls the parameter services of one node."""

    def __init__(self, observer: Observer, node: str) -> None:
        self._observer = observer
        self._node = node

    def set(self, parameters: Mapping[str, Any]) -> list[str]:
        """Set one after the other; return the reason of each refusal, or an empty text."""
        request = SetParameters.Request(parameters=_messages(parameters))
        response = self._call(SetParameters, "set_parameters", request)
        assert all(result.successful == (not result.reason) for result in response.results)
        return [result.reason for result in response.results]

    def set_at_once(self, parameters: Mapping[str, Any]) -> str:
        """Set all or none; return the reason of the refusal, or an empty text."""
        request = SetParametersAtomically.Request(parameters=_messages(parameters))
        result = self._call(SetParametersAtomically, "set_parameters_atomically", request).result
        assert result.successful == (not result.reason)
        return str(result.reason)

    def get(self, *names: str) -> list[Any]:
        response = self._call(GetParameters, "get_parameters", GetParameters.Request(names=names))
        return [parameter_value_to_python(value) for value in response.values]

    def dump(self) -> dict[str, Any]:
        """All parameters."""
        names = self._call(ListParameters, "list_parameters", ListParameters.Request()).result.names
        return dict(zip(names, self.get(*names), strict=True))

    def describe(self, *names: str) -> list[ParameterDescriptor]:
        request = DescribeParameters.Request(names=names)
        return list(self._call(DescribeParameters, "describe_parameters", request).descriptors)

    def _call(self, type_: Any, service: str, request: Any) -> Any:
        return self._observer.call(type_, f"{self._node}/{service}", request)


def _messages(parameters: Mapping[str, Any]) -> list[ParameterMsg]:
    return [Parameter(name, value=value).to_parameter_msg() for name, value in parameters.items()]
