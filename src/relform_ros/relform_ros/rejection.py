"""Why messages were not used, and how often."""

from collections import Counter
from enum import StrEnum

from relform_core.errors import MessageError


class Reason(StrEnum):
    """Why a message was rejected."""

    INVALID = "invalid"
    """Its content cannot be used: not finite, wrong size, out of its bounds."""
    FOREIGN = "foreign"
    """Its vehicle, frame or sender is unknown."""
    STALE = "stale"
    """It belongs to a step that is over, or to none."""
    EARLY = "early"
    """It belongs to a step that no node can have reached yet."""
    DUPLICATE = "duplicate"
    """This step has this message already."""


EXPLANATION_MAX = 200
"""Characters of an explanation: it may quote what a stranger sent, which may be long."""


class RejectionError(MessageError):
    """A message that was not used, and the reason, in one line."""

    def __init__(self, reason: Reason, explanation: str) -> None:
        line = "".join(each if each.isprintable() else " " for each in explanation[: EXPLANATION_MAX + 1])
        super().__init__(line if len(line) <= EXPLANATION_MAX else f"{line[: EXPLANATION_MAX - 3]}...")
        self.reason = reason


class Rejections:
    """Counts the rejected messages of one node by reason, and keeps the last explanation."""

    def __init__(self) -> None:
        self._counts: Counter[Reason] = Counter()
        self.last = ""
        """Topic and explanation of the last rejected message; empty: none."""

    def __getitem__(self, reason: Reason) -> int:
        return self._counts[reason]

    @property
    def total(self) -> int:
        """Number of rejected messages."""
        return self._counts.total()

    def count(self, topic: str, rejected: RejectionError) -> None:
        """Count a message of this topic."""
        self._counts[rejected.reason] += 1
        self.last = f"{topic}: {rejected}"
