"""Spreadsheets: the layouts of text tables, several sheets, merged cells, formulas, and files that are none."""

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
from openpyxl.styles import Font

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.readers.spreadsheets import SPREADSHEET, number_text
from creepkit.readers.tests_in_rows import TEST_TABLE
from creepkit.records import History
from helpers.workbooks import workbook

FRAMES = [["Time (h)", "Strain (%)"], [0, 0], [0.1, 0.012], [1 / 3, 0.025]]
CONDITIONS = [["Stress (MPa)", 60], ["Temperature (°C)", 850]]


def read(path: Path) -> list[History]:
    assert SPREADSHEET.accepts(path)
    return SPREADSHEET.read(path)


def merging(*parts: str):
    return lambda sheet: [sheet.merge_cells(part) for part in parts]


def test_one_test_in_one_sheet_keeps_every_digit(tmp_path: Path):
    (history,) = read(workbook(tmp_path / "bar.xlsx", {"Sheet1": CONDITIONS + FRAMES}))
    assert (history.name, history.condition) == ("bar", "850 °C, 60 MPa")
    np.testing.assert_array_equal(history.times, 3600.0 * np.array([0, 0.1, 1 / 3]))
    np.testing.assert_array_equal(history.outputs["strain"], 0.01 * np.array([0, 0.012, 0.025]))


def test_head_lines_of_canonical_files(tmp_path: Path):
    head = [["# stress_MPa: 60"], ["# temperature_C:", 850], ["# a remark"]]
    (history,) = read(workbook(tmp_path / "bar.xlsx", {"Sheet1": head + FRAMES}))
    assert history.condition == "850 °C, 60 MPa"


def test_a_test_a_sheet_with_a_sheet_of_conditions(tmp_path: Path):
    sheets = {
        "Notes": [["Measured on Monday"]],
        "Conditions": [["Test", "Stress (MPa)", "T_C", "Heat"], ["A1", 60, 850, "X7"], ["A2", 80, 860, "X8"]],
        "A1": FRAMES,
        "A2": FRAMES,
    }
    first, second = read(workbook(tmp_path / "bars.xlsx", sheets))
    assert (first.name, second.name) == ("A1", "A2")
    assert (first.condition, second.condition, second.labels["heat"]) == ("850 °C, 60 MPa", "860 °C, 80 MPa", "X8")
    assert "sheet 'Notes' not read as it has no column of time above readings" in first.labels["assumed"]
    sheets["Conditions"].append(["A3", 80, 860, "X8"])
    with pytest.raises(HistoryError, match="sheet 'Conditions', row 4: 'A3' has conditions, but no sheet or column"):
        read(workbook(tmp_path / "bars.xlsx", sheets))


def test_a_sheet_of_remarks_is_left_out(tmp_path: Path):
    """A sheet without columns of time that states nothing of a test; one that seems to is left out by its name."""
    remarks = [["Probe", "KZ01"], ["Bemerkung", "Ofen 3"]]
    (history,) = read(workbook(tmp_path / "bar.xlsx", {"KZ01": CONDITIONS + FRAMES, "Auswertung": remarks}))
    assert "sheet 'Auswertung' not read" in history.labels["assumed"]
    stated = [["Probe", "Stress (MPa)"], ["KZ02", 60]]
    path = workbook(tmp_path / "bars.xlsx", {"KZ01": CONDITIONS + FRAMES, "Auswertung": stated})
    with pytest.raises(HistoryError, match=r"sheet 'Auswertung', row 2: 'KZ02' .* is sheet 'Auswertung' to be left"):
        read(path)
    (history,) = ck.read_histories([path], ignore=["Auswertung"])
    assert history.name == "bars"


def pairs_under_pressure(name: str):
    names = [f"{name}-1: 40 bar", None, f"{name}-2: 60 bar"]
    return [names, ["t / min", "Apex height / mm"] * 2, [1, 0.3, 1, 0.5], [2, 0.4, 2, 0.6]]


def test_a_sheet_of_keys_and_values_holds_for_the_tests_of_the_others(tmp_path: Path) -> None:
    path = workbook(tmp_path / "x.xlsx", {"Info": [["Stress (MPa)", 140], ["Temperature (°C)", 550]], "Data": FRAMES})
    assert read(path)[0].condition == "550 °C, 140 MPa"


def test_a_pressure_above_pairs_and_a_sheet_of_alloys(tmp_path: Path):
    """As a user had them: `L1-1: 40 bar` above pairs, lengths by alloy below a title; one too many is asked about."""
    geometry = [["800 °C"], ["Alloy", "dimple radius [mm]", "E [GPa]"], ["L1", 8, 140], ["L2", 9, 140]]
    sheets = {"Geometry": geometry, **{name: pairs_under_pressure(name) for name in ("L1", "L2")}}
    (tmp_path / "tests.toml").write_text(
        '["x.xlsx"]\nspecimen = "plate-bulge"\ncolumns = {"dimple radius [mm]" = "radius [mm]"}\n'
    )
    tests = ck.read_histories([workbook(tmp_path / "x.xlsx", sheets)])
    found = [(one.alloy, one.loading.program().values.max(), one.geometry["radius"]) for one in tests]
    assert found == [("L1", 4.0, 8.0), ("L1", 6.0, 8.0), ("L2", 4.0, 9.0), ("L2", 6.0, 9.0)]
    assert {one.mean_temperature for one in tests} == {1073.15}
    assert all("temperature 800 °C from sheet 'Geometry' row 1" in one.labels["assumed"] for one in tests)
    geometry.append(["L3", 8, 140])
    with pytest.raises(HistoryError, match=r"'L3' has conditions, .* columns = {Geometry = \"unused\"}"):
        ck.read_histories([workbook(tmp_path / "x.xlsx", sheets)])


def test_one_column_a_test_below_merged_quantity(tmp_path: Path):
    rows = [
        ["Stress (MPa)", 60, 80],
        ["Temperature (°C)", 850, None],
        ["Time (h)", "Strain (%)", None],
        [None, "A1", "A2"],
        [0, 0, 0],
        [1, 0.5, 0.7],
    ]
    first, second = read(workbook(tmp_path / "x.xlsx", {"Sheet1": rows}, merging("B2:C2", "B3:C3", "A3:A4")))
    assert (first.name, second.name, second.condition) == ("A1", "A2", "860 °C, 80 MPa".replace("860", "850"))
    assert "holds for all" not in second.labels["assumed"]


def test_cells_that_are_shown_in_per_cent(tmp_path: Path):
    frames = [["Time (h)", "Strain"], [0, 0], [1, 0.0123]]

    def shaped(sheet):
        for (cell,) in sheet["B4:B5"]:
            cell.number_format = "0.00%"

    (history,) = read(workbook(tmp_path / "x.xlsx", {"Sheet1": CONDITIONS + frames}, shaped))
    assert history.outputs["strain"][1] == pytest.approx(0.0123, rel=1e-15)


def test_numbers_entered_as_text_with_decimal_commas(tmp_path: Path):
    frames = [["Time (h)", "Strain (%)"], [0, "0,0"], [1, "0,51"]]
    (history,) = read(workbook(tmp_path / "x.xlsx", {"Sheet1": CONDITIONS + frames}))
    assert history.outputs["strain"][1] == pytest.approx(0.0051, rel=1e-15)


REFUSED = [
    ([*FRAMES, [2, "=B3*2"]], "x.xlsx, sheet 'S', cell B7: a formula without a computed value"),
    ([*FRAMES, ["#N/A", 2]], "x.xlsx, sheet 'S', row 7: 'Time .h.' is '#N/A'; write a finite number"),
    ([*FRAMES, ["01:30:00", 2]], "x.xlsx, sheet 'S', row 7: 'Time .h.' is '01:30:00'"),
    ([*FRAMES, [0.05, 2]], "x.xlsx, sheet 'S', row 7: time falls from 1200 s to 180 s"),
    ([["Strain (%)"], [1]], "x.xlsx: no sheet has a column of time .sheets: 'S'.; name one time_h"),
    ([["Time (h)", "Strain (%)"], [0, "1,234"]], "x.xlsx, sheet 'S': '1,234' may be 1.234 or 1234"),
]


def test_what_is_refused(tmp_path: Path):
    for frames, message in REFUSED:
        with pytest.raises(HistoryError, match=message) as caught:
            read(workbook(tmp_path / "x.xlsx", {"S": CONDITIONS + frames}))
        assert "\n" not in str(caught.value)


def zipped(parts: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return stream.getvalue()


def test_what_is_no_spreadsheet(tmp_path: Path):
    """Text, nothing, another archive, entities, and a bomb."""
    entities = zipped({"xl/workbook.xml": b'<?xml version="1.0"?><!DOCTYPE a>'})
    bomb = zipped({"xl/worksheets/sheet1.xml": bytes(600_000_000)})
    none = [(x, "is no spreadsheet that can be read") for x in (b"t,s\n0,0\n", b"", zipped({"a.txt": b"a"}), entities)]
    for content, said in (*none, (bomb, "unpacks to 600 MB, more than 100 MB; save it as CSV")):
        (tmp_path / "x.xlsx").write_bytes(content)
        with pytest.raises(HistoryError, match=f"x.xlsx: {said}") as caught:
            SPREADSHEET.read(tmp_path / "x.xlsx")
        assert "\n" not in str(caught.value)


def test_what_is_hidden_is_told(tmp_path: Path):
    """Hidden sheets are left aside, hidden rows and columns are read."""

    def hidden(sheet):
        sheet.row_dimensions[5].hidden = sheet.column_dimensions["B"].hidden = True
        sheet.sheet_state = "hidden" if sheet.title == "old" else "visible"

    frames = CONDITIONS + FRAMES
    (history,) = read(workbook(tmp_path / "x.xlsx", {"S": frames, "old": frames}, hidden))
    for remark in ("sheet 'old' not read", "rows of sheet 'S' read too: 5", "columns of sheet"):
        assert f"hidden {remark}" in history.labels["assumed"]
    rows = [["Test", "Stress (MPa)", "T (C)", "t_r (h)"], *([f"A{k}", 60, 850, 100] for k in range(5))]
    table = workbook(tmp_path / "x.xlsx", {"S": rows}, hidden)
    assert "hidden rows of sheet 'S' read too: 5" in TEST_TABLE.read(table)[1].labels["assumed"]


def test_a_row_that_is_struck_through_is_left_out_and_told(tmp_path: Path):
    def struck(sheet):
        for cell in sheet[3]:
            cell.font = Font(strike=True)
        sheet["A4"].font = Font(strike=True)  # a name alone

    rows = [["test", "stress (MPa)", "T (°C)", "minimum creep rate (1/s)"]]
    rows += [[f"A{k}", 100 + 10 * k, 600, 1e-9 * 2**k] for k in range(4)]
    tests = ck.read_histories(workbook(tmp_path / "x.xlsx", {"S": rows}, struck))
    assert [one.name for one in tests] == ["A0", "A2", "A3"]
    assert all("rows struck through of sheet 'S' not read: 3" in one.labels["assumed"] for one in tests)


@pytest.mark.parametrize(
    ("value", "number_format", "text"),
    [
        (0.005, "0.00%", "0.5%"),
        (0.5, '0.00" %"', "0.5%"),
        (0.5, r"0.00\%", "0.5%"),
        (0.5, '0.00" % of the gauge"', "0.5"),
        (0.5, "0.00_%", "0.5"),
        (0.5, "[$%]0.00", "0.5"),
        (0.5, "0.00;-0.00%", "0.5"),
        (0.0, "0.00%;-0.00%;0.00", "0.0"),
        (0.5, '0.00" %";-0.00" %"', "0.5%"),
        (0.5, "[Red]0.00%", "50%"),
        (0.5, "General", "0.5"),
        (0.5, '0.00"%', "0.5%"),
    ],
)
def test_the_sign_that_scales(value: float, number_format: str, text: str):
    assert number_text(value, number_format) == text
