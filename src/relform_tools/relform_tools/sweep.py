"""Many flights over seeds and variants of a scenario: planned, flown in parallel, and resumable at any time.

Each finished run is a file of its own, written at once, under a fingerprint of everything that it depends on:
what is there is not flown again, and what no longer fits is.
"""

import csv
import hashlib
import json
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from relform_core.errors import ConfigError, RelformError
from relform_core.load import LoadedScenario, load_scenario
from relform_core.schema import Label, Schema
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_tools.statistics import aggregate, flatten
from relform_tools.summary import Ending, Json, Outcome, build_summary

TABLE = "runs.csv"
REPORT = "sweep.json"


class Variant(Schema):
    """A scenario with some keys changed."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=64)]
    title: Label
    set: tuple[str, ...]
    """Overrides ``some.key=value``, as on the command line."""


class VariantFile(Schema):
    """Content of a file of variants."""

    variants: Annotated[tuple[Variant, ...], Field(min_length=1)]


@dataclass(frozen=True)
class Run:
    """One flight of a sweep, with everything that another process or machine needs to fly it."""

    variant: str
    scenario: LoadedScenario

    @property
    def seed(self) -> int:
        """Seed of the flight."""
        return self.scenario.seed

    @property
    def fingerprint(self) -> str:
        """Changes with anything that the result depends on, the software apart."""
        return hashlib.sha256(self.scenario.effective_yaml.encode(), usedforsecurity=False).hexdigest()


def load_variants(path: Path) -> tuple[Variant, ...]:
    """Read a file of variants.

    Raises:
        ConfigError: it cannot be read or used; one line that names the file.
    """
    try:
        tree = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
        variants = VariantFile.model_validate_json(json.dumps(tree)).variants
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}") from None
    except (YAMLError, TypeError):
        raise ConfigError(f"{path}: not valid YAML") from None
    except ValidationError as error:
        details = error.errors()[0]
        key = ".".join(map(str, details["loc"]))
        raise ConfigError(f"{path}: {key}: {details['msg']} (got {details['input']!r})") from None
    names = [variant.name for variant in variants]
    for name in names:
        if names.count(name) > 1:
            raise ConfigError(f"{path}: variant '{name}' is named twice")
    return variants


def plan_runs(
    scenario: Path, variants: Sequence[Variant], overrides: Sequence[str], seeds: Sequence[int]
) -> list[Run]:
    """All flights of a sweep; every configuration is validated before the first one starts.

    Raises:
        ConfigError: the scenario or a variant cannot be used.
    """
    runs = []
    for variant in variants:
        for seed in seeds:
            try:
                loaded = load_scenario(scenario, (*overrides, *variant.set), seed)
            except ConfigError as error:
                raise ConfigError(f"variant '{variant.name}': {error}") from None
            runs.append(Run(variant.name, loaded))
    # Seed by seed, so that an unfinished sweep has about as many runs of every variant.
    return sorted(runs, key=lambda run: run.seed)


class SweepFolder:
    """Results of a sweep on disk.

    Raises:
        RelformError: the folder cannot be made, or is something else.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            (path / "runs").mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RelformError(f"{path}: cannot be made: {error.strerror}") from None

    def finished(self, run: Run) -> Json | None:
        """Row of a run that has been flown with the same configuration."""
        try:
            stored = json.loads(self._file(run).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return stored["row"] if stored.get("fingerprint") == run.fingerprint else None

    def store(self, run: Run, row: Mapping[str, Any]) -> None:
        """Keep the row of a run.

        Raises:
            RelformError: it cannot be written.
        """
        _write(self._file(run), json.dumps({"fingerprint": run.fingerprint, "row": dict(row)}, indent=1))

    def conclude(self, scenario: str, variants: Sequence[Variant], rows: Sequence[Mapping[str, Any]]) -> Json:
        """Write the table and sweep.json from the rows of all runs that are there, and return the latter."""
        fields = list(dict.fromkeys(key for row in rows for key in row))
        table = self.path / TABLE
        try:
            with table.open("w", newline="", encoding="utf-8") as stream:
                writer = csv.DictWriter(stream, fields)
                writer.writeheader()
                writer.writerows(rows)
        except OSError as error:
            raise RelformError(f"{table}: cannot be written: {error.strerror}") from None
        report = {
            "scenario": scenario,
            "variants": [
                {
                    "name": variant.name,
                    "title": variant.title,
                    "set": list(variant.set),
                    **aggregate([row for row in rows if row["variant"] == variant.name]),
                }
                for variant in variants
            ],
        }
        _write(self.path / REPORT, json.dumps(report, indent=2, allow_nan=False) + "\n")
        return report

    def _file(self, run: Run) -> Path:
        return self.path / "runs" / f"{run.variant}-s{run.seed}.json"


def _write(path: Path, text: str) -> None:
    """Write a file at once: it is never there in part."""
    draft = path.with_name(f".{path.name}")
    try:
        draft.write_text(text, encoding="utf-8")
        os.replace(draft, path)
    except OSError as error:
        raise RelformError(f"{path}: cannot be written: {error.strerror}") from None


def fly(run: Run) -> Json:
    """Fly one run in this process and return its row; whatever goes wrong is an outcome with its reason."""
    # Imported here, in the worker: the process that only plans and counts needs no CasADi.
    from relform_tools.flight import fly_in_process
    from relform_tools.metrics import flight_metrics

    scenario, begin = run.scenario, time.perf_counter()
    try:
        log = fly_in_process(scenario)
    except RelformError as error:
        row = {"scenario": scenario.config.name, "outcome": Outcome.FAILED.value, "reason": str(error)}
    else:
        outcome, reason = (
            (Outcome.FAULT, log.faults[0].description) if log.faults else (Outcome.COMPLETED, None)
        )
        flown = float(log.tick_ns[-1]) / NANOSECONDS_PER_SECOND
        ending = Ending(outcome, reason, time.perf_counter() - begin, flown)
        row = flatten(build_summary(scenario, flight_metrics(log), ending, versions={}))
    return {"variant": run.variant, "seed": run.seed, **row}


def fly_all(runs: Sequence[Run], folder: SweepFolder, executor: Executor) -> Iterator[Json]:
    """Fly what is not there yet, store each result as it comes, and yield the rows as they finish.

    An executor of `concurrent.futures` or of `dask.distributed` does. If the iteration is given up, runs that
    have not started are cancelled and those that have finished are kept.
    """
    pending: dict[Future[Json], Run] = {}
    for run in runs:
        if (row := folder.finished(run)) is not None:
            yield row
        else:
            pending[executor.submit(fly, run)] = run
    try:
        for future in as_completed(pending):
            row = future.result()
            folder.store(pending[future], row)
            yield row
    finally:
        for future in pending:
            future.cancel()
