"""The page docs/performance.md, from the figures of a benchmark."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

_BEGIN, _END = "<!-- begin of measured tables -->", "<!-- end of measured tables -->"
_PLOT = "images/solver_growth.png"


def write_page(folder: Path, figures: Mapping[str, Any]) -> None:
    """Replace the measured tables of performance.md in a folder, and draw the plot beside it."""
    page = folder / "performance.md"
    before, _, rest = page.read_text().partition(_BEGIN)
    _, _, after = rest.partition(_END)
    page.write_text(f"{before}{_BEGIN}\n{_tables(figures)}{_END}{after}")
    _draw(folder / _PLOT, figures)


def _tables(figures: Mapping[str, Any]) -> str:
    rows = figures["rows"]
    lines = ["", f"Machine: {figures['machine']}. Peer: {figures['peer'] or 'none'}.", "", *_times(rows)]
    lines += [
        "",
        "| vehicles | Python around the C code (ms) | compile (s): relform, acados "
        "| memory (MB): relform, acados |"
        " most active bounds | most difference of first inputs |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        difference = row.get("first_input_difference_max")
        lines.append(
            f"| {row['vehicles']} | {row['ours_python_ms']['median']:.3f} "
            f"| {_pair(row, 'compile_s')} | {_pair(row, 'memory_mb')} | {row['active_bounds_max']} "
            f"| {'' if difference is None else f'{difference:.0e}'} |"
        )
    if constrained := figures["constrained_rows"]:
        shares = ", ".join(f"{row['constrained_share']:.0%}" for row in constrained)
        lines += ["", f"With soft constraints on both sides, active in {shares} of the steps:", ""]
        lines += _times(constrained)
    return "\n".join([*lines, "", ""])


def _times(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    lines = [
        "| vehicles | relform: median / 99% / most | prepare, feedback | acados: median / 99% / most "
        "| ratio of medians | of most |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        phases = ", ".join(f"{row[name]['median']:.3f}" for name in ("ours_prepare_ms", "ours_feedback_ms"))
        peer = (
            (_three(row["peer_ms"]), f"{row['ratio_median']:.1f}", f"{row['ratio_max']:.1f}")
            if "peer_ms" in row
            else ("not measured", "", "")
        )
        lines.append(
            f"| {row['vehicles']} | {_three(row['ours_ms'])} | {phases} | {peer[0]} | {peer[1]} | {peer[2]} |"
        )
    return lines


def _draw(path: Path, figures: Mapping[str, Any]) -> None:
    rows = sorted(figures["rows"], key=lambda row: int(row["vehicles"]))
    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    axes = figure.add_subplot()
    for name, label, color in (("peer_ms", "acados", "tab:orange"), ("ours_ms", "relform", "tab:blue")):
        with_it = [row for row in rows if name in row]
        if not with_it:
            continue
        vehicles = [row["vehicles"] for row in with_it]
        axes.plot(vehicles, [row[name]["median"] for row in with_it], "o-", color=color, label=label)
        p99 = [row[name]["p99"] for row in with_it]
        axes.plot(vehicles, p99, ":", color=color, label=f"{label}, 99%")
    axes.set_yscale("log")
    axes.set_xticks([row["vehicles"] for row in rows])
    axes.set_xlabel("vehicles")
    axes.set_ylabel("time of one SQP step (ms)")
    axes.grid(visible=True, which="both", alpha=0.3)
    axes.legend(frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=130)


def _three(times: Mapping[str, float]) -> str:
    return " / ".join(f"{times[name]:.3f}" for name in ("median", "p99", "max"))


def _pair(row: Mapping[str, Any], name: str) -> str:
    peer = f"{row[f'peer_{name}']:.1f}" if f"peer_{name}" in row else "-"
    return f"{row[f'ours_{name}']:.1f}, {peer}"
