"""Rows that are kept as the text of columns are the rows that were put in, however they are cut."""

import pytest

from creepkit.readers.table_rows import TableRow, packed, without_empty


@pytest.mark.parametrize("empty", [{0}, {49}, {10, 11}, set(range(50))], ids=str)
def test_empty_rows_are_left_out(empty):
    rows = [TableRow(k, ("", "") if k in empty else ("", str(k))) for k in range(50)]
    assert [row.line for row in without_empty(packed(rows))] == [k for k in range(50) if k not in empty]
