"""Spreadsheets that no spreadsheet program writes, and what in them is hidden."""

import io
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from creepkit.errors import HistoryError
from creepkit.readers.rate_and_rupture_tables import TEST_TABLE
from creepkit.readers.spreadsheets import SPREADSHEET

openpyxl = pytest.importorskip("openpyxl")

SHEET, STYLES = "xl/worksheets/sheet1.xml", "xl/styles.xml"
ROWS = (["Stress (MPa)", 60], ["Temperature (C)", 850], ["Time (h)", "Strain (%)"], [0, 0], [1, 0.5], [2, 1.2])
PAD = b'<?xml version="1.0"?><!--' + b"x" * 3000 + b"-->"


def bar(path: Path) -> Path:
    book = openpyxl.Workbook()
    for row in ROWS:
        book.active.append(row)
    book.save(path)
    return path


def replaced(part: str, old: bytes, new: bytes) -> tuple[str, Callable[[bytes], bytes]]:
    def change(content: bytes) -> bytes:
        assert old in content
        return content.replace(old, new)

    return part, change


REFUSED = {
    "row falls": (*replaced(SHEET, b'<row r="6"', b'<row r="4"'), "a row is numbered 4 behind row 5; rows must rise"),
    "row below 1": (*replaced(SHEET, b'<row r="6"', b'<row r="-5"'), "a row is numbered -5 behind row 5"),
    "row too far": (*replaced(SHEET, b'<row r="6"', b'<row r="9999999999"'), "a row is numbered 9999999999 behind"),
    "gap": (*replaced(SHEET, b'<row r="6"', b'<row r="1000000"'), "row 1000000: more than 20000 empty rows"),
    "underscore": (*replaced(SHEET, b"<v>1.2</v>", b"<v>1_2</v>"), "cell B6: the number '1_2' is not written as one"),
    "digits": (
        *replaced(SHEET, b"<v>1.2</v>", "<v>\N{ARABIC-INDIC DIGIT ONE}2</v>".encode()),
        "cell B6: the number '.u06612' is not written as one",
    ),
    "merged": (
        *replaced(SHEET, b"</sheetData>", b"</sheetData><mergeCells>" + b'<mergeCell ref="A1:Z60"/>' * 10_001),
        "has 10001 merged cells, more than 10000",
    ),
    "late entity": (
        *replaced(SHEET, b"<worksheet", PAD + b'<!DOCTYPE a [<!ENTITY x "Time (min)">]><worksheet'),
        "a part of it defines XML entities",
    ),
    "expands": (*replaced(SHEET, b"</sheetData>", b"<row></row>" * 2_000_000 + b"</sheetData>"), "unpacks to 22 MB"),
    "styles": (*replaced(STYLES, b"</cellXfs>", b"<xf/>" * 400_001 + b"</cellXfs>"), "part 'styleSheet' has 400"),
    "long cell": (*replaced(SHEET, b"<v>1.2</v>", b"<v>" + b"1" * 1_000_001 + b"</v>"), "more than 1000000 characters"),
    "encoding": (
        SHEET,
        lambda part: '<?xml version="1.0" encoding="UTF-16"?>'.encode("utf-16") + part.decode().encode("utf-16")[2:],
        "a part of it is not in UTF-8",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused(case: str, tmp_path: Path):
    part, change, message = REFUSED[case]
    path = bar(tmp_path / "x.xlsx")
    stream = io.BytesIO()
    with zipfile.ZipFile(path) as source, zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as target:
        for name in source.namelist():
            target.writestr(name, change(source.read(name)) if name == part else source.read(name))
    path.write_bytes(stream.getvalue())
    with pytest.raises(HistoryError, match=f"x.xlsx.*{message}") as caught:
        SPREADSHEET.read(path)
    assert "\n" not in str(caught.value)


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
