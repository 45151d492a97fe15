"""Spreadsheets: the layouts of text tables, several sheets, merged cells, formulas, and files that are none."""

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.readers.spreadsheets import SPREADSHEET
from creepkit.records import History

openpyxl = pytest.importorskip("openpyxl")

FRAMES = [["Time (h)", "Strain (%)"], [0, 0], [0.1, 0.012], [1 / 3, 0.025]]
CONDITIONS = [["Stress (MPa)", 60], ["Temperature (°C)", 850]]


def written(path: Path, sheets: dict[str, list[list[Any]]], merged: tuple[str, ...] = (), percent: str = "") -> Path:
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
        for part in merged:
            sheet.merge_cells(part)
        for (cell,) in sheet[percent] if percent else ():
            cell.number_format = "0.00%"
    book.save(path)
    return path


def read(path: Path) -> list[History]:
    assert SPREADSHEET.accepts(path)
    return SPREADSHEET.read(path)


def test_one_test_in_one_sheet_keeps_every_digit(tmp_path: Path):
    (history,) = read(written(tmp_path / "bar.xlsx", {"Sheet1": CONDITIONS + FRAMES}))
    assert (history.name, history.condition) == ("bar", "850 °C, 60 MPa")
    np.testing.assert_array_equal(history.times, 3600.0 * np.array([0, 0.1, 1 / 3]))
    np.testing.assert_array_equal(history.outputs["strain"], 0.01 * np.array([0, 0.012, 0.025]))


def test_head_lines_of_canonical_files(tmp_path: Path):
    head = [["# stress_MPa: 60"], ["# temperature_C:", 850], ["# a remark"]]
    (history,) = read(written(tmp_path / "bar.xlsx", {"Sheet1": head + FRAMES}))
    assert history.condition == "850 °C, 60 MPa"


def test_a_test_a_sheet_with_a_sheet_of_conditions(tmp_path: Path):
    sheets = {
        "Notes": [["Measured on Monday"]],
        "Conditions": [["Test", "Stress (MPa)", "T_C", "Heat"], ["A1", 60, 850, "X7"], ["A2", 80, 860, "X8"]],
        "A1": FRAMES,
        "A2": FRAMES,
    }
    first, second = read(written(tmp_path / "bars.xlsx", sheets))
    assert (first.name, second.name) == ("A1", "A2")
    assert (first.condition, second.condition) == ("850 °C, 60 MPa", "860 °C, 80 MPa")
    assert second.labels["heat"] == "X8"
    assert "sheet 'Notes' not read as it has no column of time" in first.labels["assumed"]
    sheets["Conditions"].append(["A3", 80, 860, "X8"])
    with pytest.raises(HistoryError, match="sheet 'Conditions', row 4: 'A3' has conditions, but no sheet or column"):
        read(written(tmp_path / "bars.xlsx", sheets))


def test_a_sheet_of_remarks_is_left_out(tmp_path: Path):
    """A sheet without columns of time that states nothing of a test; one that seems to is left out by its name."""
    remarks = [["Probe", "KZ01"], ["Bemerkung", "Ofen 3"]]
    (history,) = read(written(tmp_path / "bar.xlsx", {"KZ01": CONDITIONS + FRAMES, "Auswertung": remarks}))
    assert "sheet 'Auswertung' not read" in history.labels["assumed"]
    stated = [["Probe", "Stress (MPa)"], ["KZ02", 60]]
    path = written(tmp_path / "bars.xlsx", {"KZ01": CONDITIONS + FRAMES, "Auswertung": stated})
    with pytest.raises(HistoryError, match=r"sheet 'Auswertung', row 2: 'KZ02' .* leave the sheet out .* --ignore"):
        read(path)
    (history,) = ck.read_histories([path], ignore=["Auswertung"])
    assert history.name == "bars"


def test_pairs_below_merged_names(tmp_path: Path):
    rows = [
        ["A1", None, "A2", None],
        ["Stress (MPa)", 60, "Stress (MPa)", 80],
        ["Temperature (°C)", 850, "Temperature (°C)", 860],
        ["Time (h)", "Strain (%)", "Time (h)", "Strain (%)"],
        [0, 0, 0, 0],
        [1, 0.5, 2, 0.7],
        [3, 0.9, None, None],
    ]
    first, second = read(written(tmp_path / "x.xlsx", {"Sheet1": rows}, merged=("A1:B1", "C1:D1")))
    assert (first.name, second.name, first.times.size, second.times.size) == ("A1", "A2", 3, 2)
    assert second.condition == "860 °C, 80 MPa"


def test_one_column_a_test_below_merged_quantity(tmp_path: Path):
    rows = [
        ["Stress (MPa)", 60, 80],
        ["Temperature (°C)", 850, None],
        ["Time (h)", "Strain (%)", None],
        [None, "A1", "A2"],
        [0, 0, 0],
        [1, 0.5, 0.7],
    ]
    first, second = read(written(tmp_path / "x.xlsx", {"Sheet1": rows}, merged=("B2:C2", "B3:C3", "A3:A4")))
    assert (first.name, second.name) == ("A1", "A2")
    assert second.condition == "860 °C, 80 MPa".replace("860", "850")
    assert "holds for all" not in second.labels["assumed"]


def test_cells_that_are_shown_in_per_cent(tmp_path: Path):
    frames = [["Time (h)", "Strain"], [0, 0], [1, 0.0123]]
    (history,) = read(written(tmp_path / "x.xlsx", {"Sheet1": CONDITIONS + frames}, percent="B4:B5"))
    assert history.outputs["strain"][1] == pytest.approx(0.0123, rel=1e-15)


def test_numbers_entered_as_text_with_decimal_commas(tmp_path: Path):
    frames = [["Time (h)", "Strain (%)"], [0, "0,0"], [1, "0,51"]]
    (history,) = read(written(tmp_path / "x.xlsx", {"Sheet1": CONDITIONS + frames}))
    assert history.outputs["strain"][1] == pytest.approx(0.0051, rel=1e-15)


REFUSED = {
    "formula": ([*FRAMES, [2, "=B3*2"]], "x.xlsx, sheet 'S', cell B7: a formula without a computed value"),
    "error value": ([*FRAMES, ["#N/A", 2]], "x.xlsx, sheet 'S', row 7: 'Time .h.' is '#N/A'; write a finite number"),
    "time of day": ([*FRAMES, ["01:30:00", 2]], "x.xlsx, sheet 'S', row 7: 'Time .h.' is '01:30:00'"),
    "falling time": ([*FRAMES, [0.05, 2]], "x.xlsx, sheet 'S', row 7: time falls from 1200 s to 180 s"),
    "no time": ([["Strain (%)"], [1]], "x.xlsx: no sheet has a column of time .sheets: 'S'.; name one time_h"),
    "thousands": ([["Time (h)", "Strain (%)"], [0, "1,234"]], "x.xlsx, sheet 'S': '1,234' may be 1.234 or 1234"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused(case: str, tmp_path: Path):
    frames, message = REFUSED[case]
    with pytest.raises(HistoryError, match=message) as caught:
        read(written(tmp_path / "x.xlsx", {"S": CONDITIONS + frames}))
    assert "\n" not in str(caught.value)


def zipped(parts: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"time_h,strain_pct\n0,0\n", "x.xlsx: is no spreadsheet that can be read"),
        (b"", "x.xlsx: is no spreadsheet that can be read"),
        (zipped({"a.txt": b"a"}), "x.xlsx: is no spreadsheet that can be read"),
        (
            zipped({"xl/worksheets/sheet1.xml": bytes(600_000_000)}),
            "x.xlsx: unpacks to 600 MB, more than 100 MB; save it as CSV, or if it is right, CREEPKIT_LIMITS=7",
        ),
        (
            zipped({"xl/workbook.xml": b'<?xml version="1.0"?><!DOCTYPE a>'}),
            "x.xlsx: is no spreadsheet that can be read",
        ),
    ],
    ids=["text", "empty", "another archive", "bomb", "entities"],
)
def test_what_is_no_spreadsheet(content: bytes, message: str, tmp_path: Path):
    (tmp_path / "x.xlsx").write_bytes(content)
    with pytest.raises(HistoryError, match=message) as caught:
        SPREADSHEET.read(tmp_path / "x.xlsx")
    assert "\n" not in str(caught.value)
