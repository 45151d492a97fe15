"""Samples of tables as laboratories write them: other dialects, wide layouts, spreadsheets, one row a test."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from file_samples.histories import decided, difference, read, table
from file_samples.samples import ReaderSample

import creepkit as ck
from creepkit.records import History

GERMAN = (
    "# ignore: Kraft, Bemerkung\nPrüfung 13;;;\nWerkstoff;Alloy 9;;\nTemperatur [°C];850;;\nSpannung [MPa];61,5;;\n"
    "Zeit;Dehnung;Kraft;Bemerkung\nh;%;kN;\n0;0;3,1;Start\n10,5;0,121;3,1;\n20,25;0,203;3,1;\n100;0,554;3,1;Ende\n"
)
WIDE = (
    "Stress (MPa)\t60.5\t80.5\nTemperature (°C)\t850\t850\nTime (h)\tA1 strain (%)\tA2 strain (%)\n"
    "0.5\t0.012\t0.014\n1.5\t0.512\t0.731\n2.5\t0.934\t1.525\n3.5\t1.328\t\n"
)
CLOCK = (
    "# stress_MPa: 80.5\n# temperature_C: 750\nElapsed time (h:mm:ss),strain_pct\n"
    "0:00:00,0.0\n10:30:00,0.112\n27:45:30,0.207\n100:10:00,0.411\n"
)
STAMPS = (
    "# stress_MPa: 80.5\n# temperature_C: 750\nDate/Time,strain_pct\n"
    "2025-03-04 08:00:00,0.0\n2025-03-04 18:30:00,0.112\n2025-03-05 11:45:30,0.207\n2025-03-14 11:45:30,0.411\n"
)
RATES = (
    "# alloy: Alloy 9\n# control: stress\ntest,stress_MPa,temperature_C,minimum_rate_1/h,rupture_h,heat\n"
    "A1,120.5,750.5,2.1e-4,8200.5,X7\nA2,100.5,750.5,1.5e-5,>10000.5,X7\nA3,150.5,750.5,1.3e-3,,X8\n"
)


def workbook() -> bytes:
    """A spreadsheet of two tests side by side, with merged heads, a formula's value and a column to ignore."""
    from openpyxl import Workbook

    book = Workbook()
    sheet = book.active
    assert sheet is not None
    sheet.title = "creep"
    rows: list[list[object]] = [["# ignore: load_kN"], ["A1", None, "A2", None, None]]
    rows += [["Stress (MPa)", 100.5, "Stress (MPa)", 120.5, None]]
    rows += [["Temperature (°C)", 800.5, "Temperature (°C)", 800.5, None]]
    rows += [["Time (h)", "Strain (%)", "Time (h)", "Strain (%)", "load_kN"]]
    rows += [[10.5 * k, 0.113 * k, 5.25 * k, 0.127 * k, "3 kN"] for k in range(6)]
    for row in rows:
        sheet.append(row)
    sheet.merge_cells("A2:B2")
    sheet.merge_cells("C2:D2")
    file = io.BytesIO()
    book.save(file)
    return file.getvalue()


class SheetInWorkbook:
    """Reads the XML of a sheet, or the texts of cells, as part of an otherwise sound workbook."""

    def __init__(self, book: bytes, part: str) -> None:
        self.book, self.part = book, part

    def __call__(self, path: Path) -> Sequence[History]:
        """The histories of the workbook with this part."""
        target = path.with_suffix(".xlsx")
        with zipfile.ZipFile(io.BytesIO(self.book)) as good, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as new:
            for info in good.infolist():
                content = path.read_bytes() if info.filename == self.part else good.read(info)
                new.writestr(info.filename, content)
        return ck.read_histories(target)


def plain_difference(first: Sequence[History], second: Sequence[History]) -> str:
    """As `difference`, of tests without frames too."""
    gap = difference(first, second)
    for one, other in zip(first, second, strict=False):
        rates = (one.minimum_rate, one.rupture_time, one.unruptured, float(one.times[-1]))
        others = (other.minimum_rate, other.rupture_time, other.unruptured, float(other.times[-1]))
        gap = gap or ("" if rates == others else f"{rates} and {others}")
    return gap


def samples() -> Iterator[ReaderSample]:
    """The samples of tables."""
    keys = (("Spannung", "Spnnung"), ("Zeit", "Zet"), ("Dehnung", "Denung"), ("ignore", "ignre"), ("Kraft,", "Krft,"))
    units = ((" [MPa]", ""), (" [°C]", ""), ("h;%", ";%"), ("h;%", "h;"))
    german = {"x.csv": GERMAN.encode("cp1252")}
    yield ReaderSample("csv German", german, "x.csv", read, difference, decided, reader="csv")
    utf8 = {"x.csv": GERMAN.encode()}
    yield ReaderSample("csv German UTF-8", utf8, "x.csv", read, difference, decided, "", keys, units, reader="csv")
    wide = {"x.csv": WIDE.encode()}
    names = (("Stress", "Stres"), ("Temperature", "Temprature"), ("Time", "Tme"))
    units = ((" (MPa)", ""), (" (°C)", ""), (" (h)", ""))
    yield ReaderSample("csv wide", wide, "x.csv", read, difference, decided, "", names, units, reader="csv")
    yield table("csv elapsed", {"x.csv": CLOCK}, "x.csv", "stress_MPa strain_pct", "strain_pct stress_MPa")
    yield table("csv time stamps", {"x.csv": STAMPS}, "x.csv", "stress_MPa strain_pct", "strain_pct stress_MPa")
    columns = "alloy control stress_MPa temperature_C minimum_rate_1/h rupture_h"
    sample = table("test-table", {"x.csv": RATES}, "x.csv", columns, "stress_MPa temperature_C rupture_h")
    yield ReaderSample(**{**sample.__dict__, "difference": plain_difference, "reader": "test-table"})
    book = workbook()
    yield ReaderSample("xlsx file", {"x.xlsx": book}, "x.xlsx", read, difference, decided, reader="xlsx")
    part = "xl/worksheets/sheet1.xml"
    with zipfile.ZipFile(io.BytesIO(book)) as archive:
        content = archive.read(part)
    words = (("Stress", "Stres"), ("Strain", "Strin"), ("ignore", "ignre"), ("load_kN<", "laod_kN<"))
    units = ((" (MPa)", ""), (" (°C)", ""), (" (h)", ""))
    sheet = SheetInWorkbook(book, part)
    yield ReaderSample(
        "xlsx sheet", {"part.xml": content}, "part.xml", sheet, difference, decided, "", words, units, "xlsx"
    )
