"""The section ``real_time`` of summary.json for people."""

from relform_analysis.flight.summary import Json

STATISTICS = ("median", "p99", "max")


def real_time_rows(summary: Json) -> list[tuple[str, str]]:
    """Labels and texts; none for a flight in lock-step."""
    if (found := summary.get("real_time")) is None:
        return []
    late = found["missed_steps"]
    worst = max(late, key=late.__getitem__, default=None)

    def ages(what: str) -> str:
        values = [found[f"{what}_age_{statistic}_ms"] for statistic in STATISTICS]
        return " / ".join("-" if value is None else f"{value:.1f}" for value in values) + " ms"

    return [
        ("steps finished late, most", f"{late[worst]}, {worst}" if worst and late[worst] else "0"),
        ("held back for late vehicles", f"{found.get('held_s', 0.0):.2f} s"),
        ("measurement age, 50/99/100 %", ages("measurement")),
        ("command age, 50/99/100 %", ages("command")),
    ]
