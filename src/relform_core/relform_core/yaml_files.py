"""Read and write YAML: the mapping at the top of a configuration file, and its text."""

from collections.abc import Mapping
from io import StringIO
from pathlib import Path
from typing import Any, cast

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from relform_core.errors import ConfigError
from relform_core.suggestions import path_meant


def read_mapping(path: Path) -> dict[str, Any]:
    """The mapping in a file.

    Raises:
        ConfigError: one line: the file cannot be read, or holds something else.
    """
    return parse_mapping(read_text(path), str(path))


def read_text(path: Path) -> str:
    """The text in a file.

    Raises:
        ConfigError: one line: the file cannot be read.
    """
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file{path_meant(path)}") from None
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise ConfigError(f"{path}: cannot be read: not a text file in UTF-8") from None
    except ValueError:
        raise ConfigError(f"{str(path)!r}: no path: it contains a null character") from None


def parse_mapping(text: str, origin: str) -> dict[str, Any]:
    """The mapping in a text.

    Args:
        origin: where the text comes from, for errors.
    Raises:
        ConfigError: one line: the text is not YAML, or holds something else.
    """
    try:
        tree = parse_value(text)
    except YAMLError as error:
        mark = error.problem_mark if isinstance(error, MarkedYAMLError) else None
        place = f":{mark.line + 1}:{mark.column + 1}" if mark else ""
        raise ConfigError(f"{origin}{place}: not valid YAML: {problem(error)}") from None
    if not isinstance(tree, dict) or not all(isinstance(key, str) for key in tree):
        raise ConfigError(f"{origin}: must hold a mapping of keys to values at its top level")
    return cast(dict[str, Any], tree)


def parse_value(text: str) -> Any:
    """The value in a text.

    Raises:
        YAMLError: the text is not YAML.
    """
    return YAML(typ="safe", pure=True).load(text)


def problem(error: YAMLError) -> str:
    """What is wrong, on one line."""
    text = error.problem if isinstance(error, MarkedYAMLError) else str(error)
    return " ".join(str(text).split())


def to_text(tree: Mapping[str, Any]) -> str:
    """The YAML text of a mapping, in its order."""
    stream = StringIO()
    yaml: Any = YAML(typ="safe", pure=True)  # its attributes are typed as their defaults
    yaml.width = 120
    yaml.default_flow_style = None  # short lists stay on one line
    yaml.sort_base_mapping_type_on_output = False
    yaml.dump(dict(tree), stream)
    return stream.getvalue()
