"""The key numbers of summary.json as rows of a table; beside the paper's where its flight was flown."""

from dataclasses import dataclass

from relform_analysis.flight.paper_claims import COMPARED
from relform_analysis.flight.summary import Json, Outcome
from relform_analysis.report.ending import is_steady
from relform_analysis.report.real_time_rows import real_time_rows


@dataclass(frozen=True)
class ComparedRow:
    """One number."""

    label: str
    value: str
    paper: str = ""
    """The paper's words; empty if it does not mention the number."""
    holds: bool | None = None
    """Whether the number keeps the paper's bound; None: the paper states none."""


def compared_rows(summary: Json, with_paper: bool) -> list[ComparedRow]:
    """The numbers that a flight has; without those of steady state if it did not complete.

    Args:
        summary: of the flight.
        with_paper: whether the paper's flight was flown: then numbers that only the paper has are shown too.
    """
    completed = summary["outcome"] == Outcome.COMPLETED
    numbers = [
        ComparedRow(
            number.label,
            number.text(value),
            number.paper if with_paper else "",
            number.holds(value) if with_paper else None,
        )
        for number in COMPARED
        if completed or not is_steady(number.key)
        if (value := summary[number.key]) is not None or (number.paper and with_paper)
    ]
    return numbers + [ComparedRow(label, text) for label, text in real_time_rows(summary)]
