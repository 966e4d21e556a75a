"""How well a node does, judged by its own diagnostics: one level and one line for people.

What a node counts is judged by how much it has grown since the report before, so a node recovers.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum


class Level(IntEnum):
    """The numbers of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3
    """Something that the node needs has not arrived yet."""


THRUST_LOW_PERCENT = 85.0
"""Below this part of its nominal thrust a vehicle warns."""
BY_WEIGHT = (Level.OK, Level.WARN, Level.STALE, Level.ERROR)
"""The last one in this order is the level of several findings."""

Finding = tuple[Level, str]


@dataclass(frozen=True)
class Count:
    """What it means that a count has grown."""

    key: str
    """Of the count; one that ends in a dot stands for all that begin with it."""
    level: Level
    text: str
    """For people, with ``{n}`` for the growth, and ``{name}`` for the rest of the key."""


COUNTS = (
    Count("failsafe", Level.ERROR, "intervals without a plan: {n}, the vehicle sinks on its own sensors"),
    Count("disarmed", Level.ERROR, "motors off for good"),
    Count("hovered", Level.STALE, "no command has arrived yet, the vehicle hovers"),
    Count("replayed", Level.WARN, "intervals on the plan of an earlier command: {n}"),
    Count("evaded", Level.WARN, "intervals in which another vehicle was too close: {n}"),
    Count("lowered", Level.WARN, "intervals above the geofence: {n}"),
    Count("rejected", Level.WARN, "rejected commands: {n}"),
    Count("refused", Level.WARN, "intervals with a request that the mode does not allow: {n}"),
    Count("requests.refused", Level.WARN, "refused requests: {n}"),
    Count("members.admitted", Level.WARN, "nodes that were started again: {n}"),
    Count("members.refused", Level.WARN, "processes that were refused: {n}"),
    Count("real_time.skipped_steps", Level.WARN, "skipped steps: {n}"),
    Count("real_time.incomplete_steps", Level.WARN, "steps without all messages: {n}"),
    Count("real_time.missed_steps.", Level.WARN, "steps that {name} missed: {n}"),
)
ENDED_STEPS = ("solver.solved", "solver.step_limit")
FALLBACK_STEPS = "solver.fallback"


class Health:
    """Judges the reports of one node, one after the other."""

    def __init__(self) -> None:
        self._before: Mapping[str, object] = {}

    def judge(self, values: Mapping[str, object], n_rejected: int, last_rejected: str) -> Finding:
        """The level of the node, and why, in one line; empty: there is nothing to say.

        Args:
            values: what the node reports, by key.
            n_rejected: messages that it has rejected since the start.
            last_rejected: which was the last one, and why.
        """
        values = {**values, "rejected messages": n_rejected}
        grown = {key: self._growth(key, value) for key, value in values.items()}
        self._before = values
        findings = [*_of_counts(grown), *_of_solver(grown, values), *_of_the_moment(values)]
        if n := grown["rejected messages"]:
            findings.append((Level.WARN, f"rejected messages: {n}, the last: {last_rejected}"))
        findings.sort(key=lambda finding: BY_WEIGHT.index(finding[0]), reverse=True)
        level = findings[0][0] if findings else Level.OK
        return level, "; ".join(text for _, text in findings)

    def _growth(self, key: str, value: object) -> int:
        before = self._before.get(key, 0)
        return value - before if isinstance(value, int) and isinstance(before, int) else 0


def _of_counts(grown: Mapping[str, int]) -> Iterator[Finding]:
    for count in COUNTS:
        for key, n in grown.items():
            is_meant = key.startswith(count.key) if count.key.endswith(".") else key == count.key
            if is_meant and n > 0:
                yield count.level, count.text.format(n=n, name=key.removeprefix(count.key))


def _of_solver(grown: Mapping[str, int], values: Mapping[str, object]) -> Iterator[Finding]:
    """Steps that fell back; an error if no other step was decided meanwhile."""
    if n := grown.get(FALLBACK_STEPS, 0):
        none_other = not any(grown.get(key, 0) for key in ENDED_STEPS)
        reason = values.get("solver.last_fallback_reason", "")
        yield (
            Level.ERROR if none_other else Level.WARN,
            f"steps that fell back to the plan before: {n}, {reason}",
        )


def _of_the_moment(values: Mapping[str, object]) -> Iterator[Finding]:
    """What holds at the moment."""
    thrust = values.get("thrust_percent")
    if isinstance(thrust, float) and thrust < THRUST_LOW_PERCENT:
        yield Level.WARN, f"thrust {thrust:.0f} % of nominal"
    mode, reason = values.get("team.mode"), values.get("team.reason")
    if mode in ("failsafe", "stopped"):
        yield Level.ERROR, f"the team is in {mode}: {reason}"
    if (level := values.get("separation.level", "ok")) != "ok":
        yield Level.ERROR if level == "emergency" else Level.WARN, f"separation: {values.get('separation')}"
    if breach := values.get("geofence"):
        yield Level.ERROR, f"geofence: {breach}"
    if values.get("estimator.mode") == "degraded":
        yield Level.WARN, f"the estimate is degraded: {values.get('estimator.reason')}"
    if waiting_for := values.get("estimator.waiting_for"):
        # A team with a mode waits for requests too, which is as it should be.
        yield Level.STALE if mode is None else Level.OK, f"waits for {waiting_for}"
