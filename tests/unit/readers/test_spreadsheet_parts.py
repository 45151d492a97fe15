"""Spreadsheets that no spreadsheet program writes, and what in them is hidden."""

import io
import time
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from creepkit.errors import HistoryError
from creepkit.readers.rate_and_rupture_tables import TEST_TABLE
from creepkit.readers.spreadsheet_xml import MAIN, check_sheet
from creepkit.readers.spreadsheets import SPREADSHEET

openpyxl = pytest.importorskip("openpyxl")

SHEET, STYLES, TEXTS = "xl/worksheets/sheet1.xml", "xl/styles.xml", "xl/sharedStrings.xml"
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


END, SHARED = b"</sheetData>", "vnd.openxmlformats-officedocument.spreadsheetml.sharedStrings+xml"


def value(new: bytes, part: bytes = b"<v>1.2</v>") -> tuple[bytes, bytes]:
    """The value of B6, and another in its place."""
    return part, part.replace(b"<v>1.2</v>", b"<v>" + new + b"</v>")


def shared(run: bytes) -> tuple[str, Callable[[bytes], bytes]]:
    return replaced(TEXTS, b"</sst>", b"<si>" + run * 9 + b"</si></sst>")


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
        "has more than 10000 merged cells",
    ),
    "late entity": (
        *replaced(SHEET, b"<worksheet", PAD + b'<!DOCTYPE a [<!ENTITY x "Time (min)">]><worksheet'),
        "a part of it defines XML entities",
    ),
    "expands": (*replaced(SHEET, b"</sheetData>", b"<row></row>" * 2_000_000 + b"</sheetData>"), "unpacks to 22 MB"),
    "styles": (*replaced(STYLES, b"</cellXfs>", b"<xf/>" * 400_001 + b"</cellXfs>"), "part 'styleSheet' has 400"),
    "long cell": (*replaced(SHEET, b"<v>1.2</v>", b"<v>" + b"1" * 1_000_001 + b"</v>"), "more than 100000 characters"),
    "underscores": (*replaced(SHEET, *value(b"_" * 60_000 + b"<x/>")), "cell B6: holds a row or other parts"),
    "row within": (*replaced(SHEET, *value(b"1</v><row r='9'/><v>")), "cell B6: holds a row or other parts"),
    "cell within": (*replaced(SHEET, b"<v>1.2</v>", b"<c><v>1.2</v></c>"), "cell B6: holds a row or other parts"),
    "two values": (*replaced(SHEET, *value(b"5</v><v>6")), "cell B6: has several values"),
    "cell twice": (*replaced(SHEET, b'<c r="B6"', b'<c r="A6"'), "row 6: a cell is named 'A6', which is no cell"),
    "cell of another row": (*replaced(SHEET, b'<c r="B6"', b'<c r="B90"'), "row 6: a cell is named 'B90', which is"),
    "cell too far": (*replaced(SHEET, b'<c r="B6"', b'<c r="XFE6"'), "row 6: a cell is named 'XFE6', which is no"),
    "rows of no cell": (
        *replaced(SHEET, b"</sheetData>", b"".join(b'<row r="%d"/>' % k for k in range(7, 100_100)) + b"</sheetData>"),
        "more than 100000 empty rows stand in the sheet; remove them, or if it is right, CREEPKIT_LIMITS=3",
    ),
    "cells": (
        *replaced(SHEET, b"</sheetData>", b"".join(b'<row><c r="XFD%d"/></row>' % k for k in range(7, 320)) + END),
        "has more than 5000000 cells",
    ),
    "rows elsewhere": (*replaced(SHEET, b"</sheetData>", b"</sheetData><a><row r='9'/></a>"), "a row stands outside"),
    "rows in parts": (*replaced(SHEET, b"</sheetData>", b"</sheetData><sheetData/>"), "has its rows in several parts"),
    "no such text": (
        *replaced(SHEET, END, b'<row r="9"><c t="s"><v>77</v></c></row>' + END),
        "cell A9: refers to text '77' of 0",
    ),
    "another root": (
        SHEET,
        lambda part: part.replace(b"<worksheet", b"<sheet").replace(b"</worksheet", b"</sheet"),
        "no sheet has a column of time",
    ),
    "white space in front": (SHEET, lambda part: b"\n" * 9000 + value(b"1_2", part)[1], "the number '1_2' is not"),
    "format": (
        *replaced(
            STYLES, b"<fonts", b'<numFmts><numFmt numFmtId="200" formatCode="' + b"[" * 900 + b'"/></numFmts><fonts'
        ),
        "the number format .* has 900 characters and 900 brackets",
    ),
    "runs": (
        *replaced(SHEET, b"<v>1.2</v>", b"<is>" + b"<t/>" * 100_100 + b"</is>"),
        "texts in more than 100000 parts",
    ),
    "shared runs": (*shared(b"<r/>" * 12_000), "its shared texts: texts in more than 100000 parts"),
    "unused texts": (
        TEXTS,
        lambda part: part.replace(b"</sst>", b"<si/>" * 100_000 + b"</sst>"),
        "more than 100000 of its",
    ),
    "long text": (*shared(b"<r><t>" + b"a" * 60_000 + b"</t></r>"), "its shared texts: a cell holds more than 100000"),
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
    changed(path, {part: change})
    with pytest.raises(HistoryError, match=f"x.xlsx.*{message}") as caught:
        SPREADSHEET.read(path)
    assert "\n" not in str(caught.value)


def changed(path: Path, changes: Mapping[str, Callable[[bytes], bytes]]) -> Path:
    """The file with some of its parts changed."""
    stream = io.BytesIO()
    with zipfile.ZipFile(path) as source, zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as target:
        parts = {name: source.read(name) for name in source.namelist()}
        if TEXTS in changes and TEXTS not in parts:
            kind = f'<Override PartName="/{TEXTS}" ContentType="application/{SHARED}"/></Types>'.encode()
            parts["[Content_Types].xml"] = parts["[Content_Types].xml"].replace(b"</Types>", kind)
            parts[TEXTS] = b'<sst xmlns="%b"><si><t>q</t></si></sst>' % MAIN.encode()
        for name, part in parts.items():
            target.writestr(name, changes[name](part) if name in changes else part)
    path.write_bytes(stream.getvalue())
    return path


def test_a_text_counts_as_often_as_cells_refer_to_it(tmp_path: Path):
    """1000 cells of a text of 90,000 characters: 90 million."""
    cells = b'<row r="9">' + b'<c t="s"><v>1</v></c>' * 1000 + b"</row></sheetData>"
    path = changed(
        bar(tmp_path / "x.xlsx"),
        {TEXTS: shared(b"<r><t>" + b"a" * 10_000 + b"</t></r>")[1], SHEET: replaced(SHEET, END, cells)[1]},
    )
    with pytest.raises(
        HistoryError, match="x.xlsx, sheet 'Sheet', row 9: the cells down to it hold more than 50000000"
    ):
        SPREADSHEET.read(path)


def test_what_stands_beside_the_rows_is_not_parsed(tmp_path: Path):
    """Neither what it says nor how much of it there is counts: openpyxl refuses such a format, or takes long."""
    beside = (
        b'<conditionalFormatting sqref="' + b"A1 " * 200_000 + b'no"/><headerFooter><oddHeader>&amp;L' + b"&amp;" * 9000
    )
    path = changed(
        bar(tmp_path / "x.xlsx"), {SHEET: replaced(SHEET, END, END + beside + b"</oddHeader></headerFooter>")[1]}
    )
    start = time.process_time()
    (history,) = SPREADSHEET.read(path)
    assert time.process_time() - start < 2.0
    assert list(history.times / 3600) == [0, 1, 2]


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(lambda n: b"<c r='A9' t='str'><v>" + b"_" * (n // 50) + b"</v></c>", id="underscores"),
        pytest.param(lambda n: b"<c t='str'><v>a_b</v></c>" * (n // 100), id="cells"),
        pytest.param(lambda n: b"<c><is><t/></is></c>" * (n // 20), id="runs"),
        pytest.param(lambda n: b"<c r='A9' a='" + b" r r = " * (n // 10) + b"'/>", id="attribute"),
    ],
)
def test_the_time_of_a_check_grows_with_the_size_alone(text: Callable[[int], bytes]):
    """Four times the size takes no more than eight times as long; sixteen times, where time were its square."""

    def seconds(size: int) -> float:
        part = b'<worksheet xmlns="%b"><sheetData><row r="9">%b</row></sheetData></worksheet>'
        filled = part % (MAIN.encode(), text(size))
        times = []
        for _ in range(3):
            start = time.process_time()
            check_sheet("x", filled)
            times.append(time.process_time() - start)
        return min(times)

    assert seconds(800_000) < 8 * max(seconds(200_000), 0.002)


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
