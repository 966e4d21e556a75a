"""Rows of numbers by instant, in one growing array: a flight of an hour stays small."""

from collections.abc import Iterable, KeysView, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

FIRST_ROWS = 1024


class StampedRows:
    """A table with one row per instant; a new row is NaN.

    Args:
        columns: name and shape of each column, all in double precision.
    """

    def __init__(self, columns: Iterable[tuple[str, tuple[int, ...]]]) -> None:
        self._dtype = np.dtype([(name, np.float64, shape) for name, shape in columns])
        self._rows: npt.NDArray[Any] = np.full(FIRST_ROWS, np.nan, self._dtype)
        self._index: dict[int, int] = {}

    @property
    def stamps(self) -> KeysView[int]:
        """The instants that have a row [ns]."""
        return self._index.keys()

    def at(self, stamp_ns: int) -> Any:
        """The row of an instant, to be filled by column: ``rows.at(stamp_ns)["p_NB_N"] = ...``."""
        index = self._index.setdefault(stamp_ns, len(self._index))
        if index == len(self._rows):
            self._rows = np.concatenate([self._rows, np.full(index, np.nan, self._dtype)])
        return self._rows[index]

    def column(self, name: str, stamps: Sequence[int]) -> npt.NDArray[np.float64]:
        """One column at some instants, shape (instants, ...)."""
        rows = np.fromiter((self._index[stamp_ns] for stamp_ns in stamps), dtype=np.int64, count=len(stamps))
        return np.ascontiguousarray(self._rows[name][rows])
