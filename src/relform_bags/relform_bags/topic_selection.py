"""Which topics of many are meant."""

import re
from collections.abc import Collection
from dataclasses import dataclass

from relform_core.errors import BagError


@dataclass(frozen=True)
class TopicSelection:
    """Topics by name, by type and by regular expression, in the sense of ``ros2 bag``; nothing given: all.

    Where one of names, types and expression is given, a topic is meant that any of them says; the exclusions
    go before.
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
        """Raises BagError if an expression is none."""
        for regex in (self.regex, self.exclude_regex):
            try:
                re.compile(regex)
            except re.error as error:
                raise BagError(f"'{regex}' is no regular expression: {error}") from None

    @property
    def takes_all(self) -> bool:
        """Whether nothing is said of what to take."""
        return not (self.names or self.types or self.regex)

    def takes(self, name: str, type_name: str) -> bool:
        """Whether a topic is meant."""
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
    """The name of a topic seen from the root."""
    return name if name.startswith("/") else f"/{name}"
