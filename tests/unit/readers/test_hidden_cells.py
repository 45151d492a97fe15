"""What is hidden in a spreadsheet is told."""

from pathlib import Path

import pytest

from creepkit.readers.rate_and_rupture_tables import TEST_TABLE
from creepkit.readers.spreadsheets import SPREADSHEET

openpyxl = pytest.importorskip("openpyxl")

ROWS = (["Stress (MPa)", 60], ["Temperature (C)", 850], ["Time (h)", "Strain (%)"], [0, 0], [1, 0.5], [2, 1.2])


def bar(path: Path) -> Path:
    book = openpyxl.Workbook()
    for row in ROWS:
        book.active.append(row)
    book.save(path)
    return path


def test_hidden_sheets_are_left_aside_and_hidden_rows_told(tmp_path: Path):
    book = openpyxl.load_workbook(bar(tmp_path / "x.xlsx"))
    old = book.copy_worksheet(book.active)
    old.title, old.sheet_state = "old", "hidden"
    book.active.row_dimensions[5].hidden = True
    book.active.column_dimensions["B"].hidden = True
    book.save(tmp_path / "x.xlsx")
    (history,) = SPREADSHEET.read(tmp_path / "x.xlsx")
    for remark in (
        "hidden sheet 'old' not read",
        "hidden rows of sheet 'Sheet' read too: 5",
        "hidden columns of sheet",
    ):
        assert remark in history.labels["assumed"]


def test_hidden_rows_of_a_table_of_tests_are_told(tmp_path: Path):
    book = openpyxl.Workbook()
    for row in (["Test", "Stress (MPa)", "T (C)", "t_r (h)"], ["A", 60, 850, 100], ["B", 60, 860, 90]):
        book.active.append(row)
    book.active.row_dimensions[3].hidden = True
    book.save(tmp_path / "x.xlsx")
    assert "hidden rows of sheet 'Sheet' read too: 3" in TEST_TABLE.read(tmp_path / "x.xlsx")[1].labels["assumed"]
