"""Files with the path of a leader, in CSV: the columns t_s, x_m, y_m, z_m and, if wanted, yaw_deg."""

import csv
import math
from collections.abc import Sequence
from io import StringIO
from pathlib import Path
from typing import Any

from relform_core.arrays import Array
from relform_core.atomic_file import write_atomically
from relform_core.errors import ConfigError
from relform_core.yaml_files import read_text

COLUMNS = ("t_s", "x_m", "y_m", "z_m")
YAW = "yaw_deg"


def read_path(path: Path | str) -> dict[str, Any]:
    """The samples in a file as the keys ``times_s``, ``points_m`` and, if they are given, ``yaws_deg``.

    Raises:
        ConfigError: one line: the file cannot be read, or a line is wrong.
    """
    rows = csv.reader(StringIO(read_text(Path(path))))
    header = tuple(name.strip() for name in next(rows, ()))
    if header not in (COLUMNS, (*COLUMNS, YAW)):
        expected = ",".join(COLUMNS)
        raise ConfigError(
            f"{path}:1: must be the header '{expected}' or '{expected},{YAW}' (got {','.join(header)!r})"
        )
    samples = [_sample(row, header, f"{path}:{rows.line_num}") for row in rows if row]
    written: dict[str, Any] = {
        "times_s": [sample[0] for sample in samples],
        "points_m": [sample[1:4] for sample in samples],
    }
    return written | ({"yaws_deg": [sample[4] for sample in samples]} if YAW in header else {})


def write_path(path: Path | str, samples: Array) -> None:
    """Write a file.

    Args:
        path: of the file.
        samples: time [s], x, y, z [m] and yaw [deg], shape (sample, 5).
    Raises:
        RelformError: the file cannot be written.
    """
    lines = [",".join((*COLUMNS, YAW))]
    lines += ["{:.3f},{:.4f},{:.4f},{:.4f},{:.2f}".format(*sample) for sample in samples.tolist()]
    write_atomically(path, "\n".join(lines) + "\n")


def _sample(row: Sequence[str], header: Sequence[str], where: str) -> list[float]:
    if len(row) != len(header):
        raise ConfigError(f"{where}: must have {len(header)} values (got {len(row)})")
    sample = []
    for name, text in zip(header, row, strict=True):
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise ConfigError(f"{where}: {name}: must be a finite number (got {text!r})")
        sample.append(value)
    return sample
