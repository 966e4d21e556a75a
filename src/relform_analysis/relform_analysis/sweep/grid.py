"""A grid over parameters: every combination of their values is a variant of the scenario."""

import hashlib
import itertools
import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import JsonValue
from ruamel.yaml.error import YAMLError

from relform_analysis.sweep.variant import NAME_LENGTH, Variant
from relform_core.errors import ConfigError
from relform_core.schema import LABEL_LENGTH
from relform_core.yaml_files import parse_value

Grid = Mapping[str, Sequence[JsonValue]]
"""Values of each parameter, by its key ``some.key``."""
VARIANTS_MAX = 1000
"""More are a mistake: each is flown with several seeds."""
_NO_FILE_NAME = re.compile(r"[^A-Za-z0-9_.-]+")
_UNIT_OF_WEIGHT = re.compile(r"_per_\w+$")


class GridVariant(Variant):
    """The scenario at one point of a grid."""

    values: dict[str, JsonValue]

    @property
    def parameters(self) -> Mapping[str, JsonValue]:
        """The value of each parameter by its key, as the grid gives it."""
        return self.values

    def problem(self, error: ConfigError) -> str:
        """An error of loading the scenario at this point, one line or more."""
        text = str(error)
        for key in self.values:
            text = re.sub(rf"--set {re.escape(key)}(?![\w.])", f"--grid {key}", text)
        return text if text.startswith("--grid") else super().problem(error)


def parse_grid(options: Sequence[str]) -> dict[str, list[JsonValue]]:
    """The grid of a command line.

    Args:
        options: texts ``some.key=value,value``; each value is YAML, so a list is written ``[1,2]``.
    Raises:
        ConfigError: one line: the option that cannot be used.
    """
    grid: dict[str, list[JsonValue]] = {}
    for option in options:
        key, separator, text = (part.strip() for part in option.partition("="))
        if not separator or not key:
            raise ConfigError(f"--grid {option}: must have the form some.key=value,value")
        if key in grid:
            raise ConfigError(f"--grid {key}: is given twice; list all its values in one --grid")
        try:
            values = parse_value(f"[{text}]")
            json.dumps(values, allow_nan=False)
        except (YAMLError, TypeError, ValueError):
            raise ConfigError(f"--grid {option}: the values are no list in YAML, such as 5,10,20") from None
        grid[key] = values
    return grid


def grid_variants(grid: Grid, prefix: str = "--grid ") -> tuple[GridVariant, ...]:
    """The Cartesian product of a grid, in which the last parameter varies fastest.

    Args:
        prefix: of a key in errors: where the grid was written.
    Raises:
        ConfigError: one line: a parameter has no value or the same one twice, or there are too many variants.
    """
    for key, values in grid.items():
        if not values:
            raise ConfigError(f"{prefix}{key}: needs at least one value")
        for index, value in enumerate(values):
            if value in values[:index]:
                raise ConfigError(f"{prefix}{key}: has the value {value_text(value)} twice")
    sizes = [len(values) for values in grid.values()]
    combinations = list(itertools.islice(itertools.product(*grid.values()), VARIANTS_MAX + 1))
    if len(combinations) > VARIANTS_MAX:
        product = " x ".join(map(str, sizes))
        raise ConfigError(
            f"{prefix[:-1]}: {product} values give more than {VARIANTS_MAX} variants; list fewer"
        )
    words = short_keys(list(grid))
    return tuple(
        _variant(dict(zip(grid, combination, strict=True)), [words[key] for key in grid])
        for combination in combinations
    )


def short_keys(keys: Sequence[str]) -> dict[str, str]:
    """A word for each key, different from all others: its last part, or more of it where that is not enough.

    The unit of a weight is left out: ``controller.weights.torque_per_n2_m2`` is ``torque``.
    """
    words: dict[str, str] = {}
    for key in keys:
        parts = key.split(".")
        candidates = [_UNIT_OF_WEIGHT.sub("", parts[-1])]
        candidates += [".".join(parts[-length:]) for length in range(1, len(parts) + 1)]
        words[key] = next(
            (
                word
                for word in candidates
                if not any(_may_mean(word, other) for other in keys if other != key)
            ),
            key,
        )
    return words


def _may_mean(word: str, key: str) -> bool:
    return f".{key}".endswith(f".{word}") or _UNIT_OF_WEIGHT.sub("", key.rpartition(".")[2]) == word


def _variant(values: dict[str, JsonValue], words: Sequence[str]) -> GridVariant:
    texts = [value_text(value) for value in values.values()]
    overrides = (f"{key}={_override_text(value)}" for key, value in values.items())
    name = "_".join(f"{word}-{text}" for word, text in zip(words, texts, strict=True))
    title = ", ".join(f"{word} {text}" for word, text in zip(words, texts, strict=True))
    return GridVariant(
        name=_file_name(name),
        title=title if len(title) <= LABEL_LENGTH else f"{title[: LABEL_LENGTH - 1]}…",
        set=tuple(overrides),
        values=values,
    )


def value_text(value: JsonValue) -> str:
    """A value for people and names: a number as short as possible, a text without quotes."""
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    return value if isinstance(value, str) else json.dumps(value)


def _override_text(value: JsonValue) -> str:
    """A value as an override writes it."""
    return value if isinstance(value, str) and _is_read_back(value) else json.dumps(value)


def _is_read_back(text: str) -> bool:
    try:
        read: Any = parse_value(text)
    except YAMLError:
        return False
    return bool(read == text)


def _file_name(name: str) -> str:
    """A name that may be one of a file; if it had to be changed, with a hash of the original."""
    plain = _NO_FILE_NAME.sub("-", name).lstrip("_.-")
    if plain == name and len(name) <= NAME_LENGTH:
        return name
    digest = hashlib.sha256(name.encode(), usedforsecurity=False).hexdigest()[:8]
    return f"{plain[: NAME_LENGTH - 9]}-{digest}".lstrip("-")
