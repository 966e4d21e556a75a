"""A table of numbers by instant."""

import numpy as np

from relform_analysis.flight.stamped_rows import FIRST_ROWS, StampedRows

COLUMNS = (("p_NB_N", (3,)), ("pairs", (2, 2)), ("yaw", ()))


def test_rows_are_nan_until_they_are_filled() -> None:
    rows = StampedRows(COLUMNS)
    rows.at(50)["yaw"] = 1.5
    rows.at(20)["pairs"][1, 0] = 2.5
    rows.at(50)["p_NB_N"] = (1.0, 2.0, 3.0)
    np.testing.assert_array_equal(rows.column("yaw", [20, 50]), [np.nan, 1.5])
    np.testing.assert_array_equal(rows.column("p_NB_N", [50]), [[1.0, 2.0, 3.0]])
    np.testing.assert_array_equal(rows.column("pairs", [20]), [[[np.nan, np.nan], [2.5, np.nan]]])
    assert list(rows.stamps) == [50, 20]


def test_table_grows_and_keeps_its_rows() -> None:
    rows, n = StampedRows(COLUMNS), 3 * FIRST_ROWS
    for stamp_ns in range(n):
        rows.at(stamp_ns)["yaw"] = stamp_ns
    column = rows.column("yaw", range(n))
    np.testing.assert_array_equal(column, np.arange(n))
    assert column.flags.c_contiguous


def test_no_rows() -> None:
    assert StampedRows(COLUMNS).column("pairs", []).shape == (0, 2, 2)
