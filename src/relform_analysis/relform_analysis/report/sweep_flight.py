"""One flight of a sweep as a log: the one that the sweep kept, else flown again, which gives the same."""

from dataclasses import replace
from pathlib import Path

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.summary import Json
from relform_analysis.report.flight_source import summary_of
from relform_analysis.report.sweep_source import Sweep, is_sweep, read_sweep
from relform_analysis.sweep.folder import SweepFolder
from relform_analysis.sweep.plan import Run, plan_runs
from relform_analysis.sweep.variant import Variant
from relform_core.errors import RelformError

SEED = "-s"
"""Between variant and seed, as in the names of the files of a sweep."""


def is_sweep_flight(source: str) -> bool:
    """Whether a source has the form ``SWEEP:VARIANT``, with or without ``-sSEED``."""
    folder, separator, variant = source.rpartition(":")
    return bool(separator and variant) and not Path(source).exists() and is_sweep(Path(folder))


def read_sweep_flight(source: str) -> tuple[FlightLog, Json]:
    """The log and the summary of a flight of a sweep; without a seed, of the first one.

    Raises:
        RelformError: the sweep has no such flight, or scenario or software have changed since.
    """
    folder, _, name = source.rpartition(":")
    path = Path(folder)
    sweep = read_sweep(path)
    run, stored = _run(sweep, source, name), SweepFolder(path if path.is_dir() else path.parent)
    if stored.finished(run) is None:
        raise RelformError(
            f"{source}: scenario or software changed since it was flown; run the command of the sweep again"
        )
    keeping = replace(run, keeps_log=True)
    if stored.finished(keeping) is not None:
        log = stored.log(keeping)
    else:
        from relform_analysis.flight.simulate import fly_in_process  # CasADi is slow to import

        log = fly_in_process(run.scenario)
    return log, summary_of(log, versions=sweep.report.get("versions"))


def _run(sweep: Sweep, source: str, name: str) -> Run:
    variants = {variant["name"]: variant for variant in sweep.report["variants"]}
    variant, seed = name, ""
    if name not in variants:
        variant, _, seed = name.rpartition(SEED)
    if variant not in variants:
        raise RelformError(f"{source}: unknown variant {name}, expected one of {', '.join(variants)}")
    seeds = [int(row["seed"]) for row in sweep.rows if row["variant"] == variant]
    if seed and (not seed.isdecimal() or int(seed) not in seeds):
        raise RelformError(
            f"{source}: no flight with seed {seed}; seeds of {variant} are {', '.join(map(str, seeds))}"
        )
    planned = variants[variant]
    changed = Variant(
        name=variant,
        title=planned["title"],
        scenario=planned.get("scenario"),
        set=tuple(planned["set"]),
    )
    chosen = int(seed) if seed else seeds[0]
    return plan_runs(sweep.report["scenario"], [changed], sweep.report.get("set", []), [chosen])[0]
