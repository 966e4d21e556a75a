"""The values that `ros2 param set` and `load` read from text and files."""

from pathlib import Path
from typing import Any

import pytest
from rclpy.parameter import parameter_value_to_python

from relform_cli.errors import CommandError
from relform_cli.parameters import parameters_from_file, value_from_text


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("true", True),
        ("-7", -7),
        ("2.5", 2.5),
        ("leader", "leader"),
        ("'12'", "12"),
        ("[1, 2]", [1, 2]),
        ("[0.5, 2.0]", [0.5, 2.0]),
        ("[a, b c]", ["a", "b c"]),
        ("[1, a]", "[1, a]"),
        ("{a: 1}", "{a: 1}"),
        ("2024-01-31", "2024-01-31"),
        ("[1, 2", "[1, 2"),
    ],
)
def test_value(text: str, value: Any) -> None:
    found = parameter_value_to_python(value_from_text(text))
    assert (list(found) if isinstance(value, list) else found) == value


def loaded(path: Path, use_wildcard: bool = True) -> dict[str, Any]:
    parameters = parameters_from_file(str(path), use_wildcard)
    return {parameter.name: parameter_value_to_python(parameter.value) for parameter in parameters}


def test_file(tmp_path: Path) -> None:
    path = tmp_path / "parameters.yaml"
    path.write_text(
        "/alpha/talker: {ros__parameters: {gain: 5.0, name: {last: 'x: y'}, digits: '12', none: null}}\n"
        "/**: {ros__parameters: {gain: 4.0, flag: true}}\n"
    )
    own = {"gain": 5.0, "name.last": "x: y", "digits": "12"}
    assert loaded(path) == own | {"flag": True}
    assert loaded(path, use_wildcard=False) == own


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"[1, 2", " is not YAML: expected ',' or ']', but got '<stream end>' at line 1, column 6"),
        (b"\xff\xfe\x00", " is not YAML: cannot be read"),
        (b"", " is not '<node>: {ros__parameters: {...}}'"),
        (b"[1]", " is not '<node>: {ros__parameters: {...}}'"),
        (b"5", " is not '<node>: {ros__parameters: {...}}'"),
        (b"/alpha/talker: {gain: 5.0}", " is not '<node>: {ros__parameters: {...}}'"),
        (b"/alpha/talker: {ros__parameters: 5}", " is not '<node>: {ros__parameters: {...}}'"),
    ],
)
def test_reports_files_that_hold_no_parameters(tmp_path: Path, content: bytes, reason: str) -> None:
    path = tmp_path / "parameters.yaml"
    path.write_bytes(content)
    with pytest.raises(CommandError) as caught:
        loaded(path)
    assert str(caught.value) == f"{path}{reason}"


@pytest.mark.parametrize(
    ("content", "use_wildcard"), [("/**: {ros__parameters: {gain: 4.0}}", False), ("{}", True)]
)
def test_file_without_parameters_to_load(tmp_path: Path, content: str, use_wildcard: bool) -> None:
    path = tmp_path / "parameters.yaml"
    path.write_text(content)
    with pytest.raises(CommandError, match="Param file does not contain selected parameters"):
        parameters_from_file(str(path), use_wildcard)
