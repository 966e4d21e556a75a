"""Select topics by name, type and regular expression."""

import re
from collections.abc import Collection
from dataclasses import dataclass

from relform_core.errors import BagError


@dataclass(frozen=True)
class TopicSelection:
    """Topics by name, type or regular expression, as in ``ros2 bag``; if none of these is given, all topics.

    A topic is selected if any of names, types and expression selects it and no exclusion matches it.
    """

    names: Collection[str] = ()
    types: Collection[str] = ()
    regex: str = ""
    exclude_names: Collection[str] = ()
    exclude_types: Collection[str] = ()
    exclude_regex: str = ""
    whole_name: bool = False
    """Whether an expression must match a name from its beginning to its end."""

    def __post_init__(self) -> None:
        """Raises BagError if a regular expression is not valid."""
        for regex in (self.regex, self.exclude_regex):
            try:
                re.compile(regex)
            except re.error as error:
                raise BagError(f"'{regex}' is not a valid regular expression: {error}") from None

    @property
    def takes_all(self) -> bool:
        """Whether no name, type or expression is given."""
        return not (self.names or self.types or self.regex)

    def takes(self, name: str, type_name: str) -> bool:
        """Whether a topic is selected."""
        if name in self.exclude_names or type_name in self.exclude_types:
            return False
        if self.exclude_regex and self._matches(self.exclude_regex, name):
            return False
        if self.takes_all or name in self.names or type_name in self.types:
            return True
        return bool(self.regex) and self._matches(self.regex, name)

    def _matches(self, regex: str, name: str) -> bool:
        match = re.fullmatch if self.whole_name else re.search
        return match(regex, name) is not None


def absolute(name: str) -> str:
    """The absolute name of a topic."""
    return name if name.startswith("/") else f"/{name}"
