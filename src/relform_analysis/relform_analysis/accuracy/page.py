"""The accuracy table as a Markdown page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from relform_analysis.accuracy.goals import GOALS, NOMINAL, Goal
from relform_analysis.flight.summary import Json

RAW, TEAM = "raw", "team"
"""Names of the two variants of every case."""
INTRODUCTION = """# Accuracy: the team estimator beside raw feedback

Written by `make accuracy` from commit {commit}: {seeds} flights of each case with the team
estimator, and the first {raw_seeds} of them with raw feedback, seeds {first} to {last}, which nothing was
tuned on. `team` is `controller=team`, `raw` is `controller=retuned`; both keep their settings in all cases,
which are in [config/sweeps/accuracy.yaml](../config/sweeps/accuracy.yaml). All errors are true errors;
[summary.md](summary.md) defines each number.

Numbers are means over the completed flights. *Steady* is the formation error in steady state: its mean
(that of the worst flight), its 95th percentile, and its maximum in all flights. *Peak A* is the largest
formation error in phase A. *After* are the largest formation error and the largest error of the leader's
position after the event of the case begins. *Settled* is when the formation error first stays below
0.05 m."""
TARGETS = """## Targets

They are for the team estimator."""
CONSISTENCY = """## Consistency

The normalised estimation error squared (NEES) per degree of freedom in steady state is 1 if the covariances
of the team estimator are right, and above 1 if they are too small. *NIS inside* is the share of the steps
in which the normalised innovation squared of range and bearing is inside its 95 % interval.
`scripts/bound.py` compares the estimation errors with the posterior Cramer-Rao bound of the sensors."""
AGAIN = """## Fly it again

```
make accuracy                                             # everything; continues after a stop
make accuracy ARGS="--cases nominal bursts --seeds 10"    # some of it
.venv/bin/python scripts/report.py runs/accuracy/nominal  # a page of one case, flight by flight
```

The command writes this page to `runs/accuracy/accuracy.md`. It exits with 1 if a target is missed."""


@dataclass(frozen=True)
class Column:
    """A number of the flights in the table."""

    heading: str
    key: str
    digits: int = 4
    factor: float = 1.0
    statistic: str = "mean"

    def text(self, variant: Json) -> str:
        """Its statistic over the completed flights; ``-`` if none has it."""
        metric = variant["metrics"].get(self.key)
        value = None if metric is None else metric[self.statistic]
        return "-" if value is None else f"{self.factor * value:.{self.digits}f}"


WORST = Column("", "steady_mean_m", statistic="max")
COLUMNS = (
    Column("steady (worst) [m]", "steady_mean_m"),
    Column("95 % [m]", "steady_p95_m"),
    Column("max [m]", "steady_max_m", statistic="max"),
    Column("peak A [m]", "phases.A.max_m"),
    Column("after: peak [m]", "event_peak_m"),
    Column("leader [m]", "leader_steady_mean_m"),
    Column("after: leader [m]", "event_leader_max_m"),
    Column("leader yaw [deg]", "leader_yaw_steady_mean_deg", 2),
    Column("follower yaw [deg]", "follower_yaw_steady_mean_deg", 2),
    Column("rotor std [rpm]", "rotor_std_rpm", 0),
    Column("saturated [%]", "saturated_fraction", 1, 100.0),
    Column("settled [s]", "start_settled_s", 2),
)
CONSISTENCY_COLUMNS = (
    Column("relative position", "position_nees", 2),
    Column("relative yaw", "yaw_nees", 2),
    Column("leader position", "leader_nees", 2),
    Column("NIS inside [%]", "nis_inside_fraction", 1, 100.0),
)


@dataclass(frozen=True)
class Case:
    """The flights of one case."""

    name: str
    title: str
    raw: Json
    """Statistics of the flights, as in sweep.json."""
    team: Json


@dataclass(frozen=True)
class Verdict:
    """Whether one target is met."""

    case: Case
    label: str
    wanted: str
    found: str
    raw: str
    is_met: bool

    @property
    def line(self) -> str:
        """The same in one line."""
        return f"{self.case.name}: {self.label}: {self.found}, must be {self.wanted}"


def verdicts(cases: Sequence[Case]) -> list[Verdict]:
    """All targets of the cases."""
    nominal = next((case.team for case in cases if case.name == NOMINAL), None)
    return [verdict for case in cases for verdict in _verdicts(case, nominal)]


def _verdicts(case: Case, nominal: Json | None) -> list[Verdict]:
    runs, completed = case.team["runs"], case.team["completed"]
    survived = Verdict(
        case,
        "flights completed",
        f"{runs}",
        f"{completed}",
        f"{case.raw['completed']} of {case.raw['runs']}",
        completed == runs,
    )
    return [survived, *(_verdict(case, goal, nominal) for goal in GOALS.get(case.name, ()))]


def _verdict(case: Case, goal: Goal, nominal: Json | None) -> Verdict:
    relation = "at least" if goal.is_lower else "at most"
    return Verdict(
        case,
        goal.label,
        f"{relation} {goal.text(goal.wanted(nominal))}",
        goal.text(goal.found(case.team)),
        goal.text(goal.found(case.raw)) if case.raw["completed"] else "-",
        goal.is_met(case.team, nominal),
    )


def accuracy_page(
    cases: Sequence[Case], seeds: range, raw_seeds: int, versions: Mapping[str, str | None]
) -> str:
    """The page with all tables.

    Args:
        seeds: of the flights of every case with the team estimator.
        raw_seeds: how many of them are flown with raw feedback, too.
        versions: of the software.
    """
    introduction = INTRODUCTION.format(
        commit=versions.get("git_commit") or "unknown",
        seeds=len(seeds),
        raw_seeds=min(raw_seeds, len(seeds)),
        first=seeds[0],
        last=seeds[-1],
    )
    return "\n".join([
        introduction,
        "",
        *_table(["", "", "completed", *(column.heading for column in COLUMNS)], _rows(cases)),
        "",
        TARGETS,
        "",
        *_table(["", "number", "wanted", "team", "raw"], _target_rows(cases)),
        "",
        CONSISTENCY,
        "",
        *_table(
            ["", *(column.heading for column in CONSISTENCY_COLUMNS)],
            [[case.title, *(column.text(case.team) for column in CONSISTENCY_COLUMNS)] for case in cases],
        ),
        "",
        AGAIN,
        "",
    ])  # fmt: skip


def _rows(cases: Sequence[Case]) -> list[list[str]]:
    rows = []
    for case in cases:
        for name, variant in ((TEAM, case.team), (RAW, case.raw)):
            cells = [column.text(variant) for column in COLUMNS]
            cells[0] += f" ({WORST.text(variant)})"
            title = case.title if name == TEAM else ""
            rows.append([title, name, f"{variant['completed']} of {variant['runs']}", *cells])
    return rows


def _target_rows(cases: Sequence[Case]) -> list[list[str]]:
    rows, last = [], None
    for verdict in verdicts(cases):
        title = "" if verdict.case is last else verdict.case.title
        last = verdict.case
        found = verdict.found if verdict.is_met else f"{verdict.found} **missed**"
        rows.append([title, verdict.label, verdict.wanted, found, verdict.raw])
    return rows


def _table(head: Sequence[str], body: Sequence[Sequence[str]]) -> list[str]:
    rule = ["---", *["---:"] * (len(head) - 1)]
    return [f"| {' | '.join(cells)} |" for cells in (head, rule, *body)]
