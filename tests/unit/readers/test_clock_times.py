"""Times of clocks: elapsed times are read, time stamps count from the first row, what may be either is asked for."""

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from openpyxl import Workbook

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.records import History
from helpers.workbooks import workbook

HEAD = "# stress_MPa: 60\n# temperature_C: 850\n"


def read(name: str, cells: list[str], path: Path, head: str = "") -> History:
    rows = "".join(f"{cell};0,{k + 1}12\n" for k, cell in enumerate(cells))
    path.write_text(f"{HEAD}{head}{name};Strain (%)\n{rows}", encoding="utf-8")
    (history,) = ck.read_histories(path)
    return history


@pytest.mark.parametrize(
    ("name", "cells", "hours", "assumed"),
    [
        ("Elapsed time (h:mm:ss)", ["1:02:30", "27:45:00"], [1 + 2.5 / 60, 27.75], ""),
        ("Time", ["0:30:00", "10:30:00"], [0.5, 10.5], "elapsed"),
        ("Time", ["01:30:00", "130:30:00"], [1.5, 130.5], "elapsed"),
        ("Time of day", ["22:30:00", "23:30:00", "01:00:00"], [0, 1, 2.5], "time since the first row at 22:30:00"),
        ("Zeit", ["2025-03-04 08:00:00", "2025-03-05 09:30:00"], [0, 25.5], "first row at 2025-03-04 08:00:00"),
        ("Timestamp", ["2025-03-04T08:00:00+01:00", "2025-03-04T08:00:00Z"], [0, 1], "first row"),
        ("Date/Time", ["3/4/2025 23:00", "3/13/2025 1:00 AM"], [0, 8 * 24 + 2], "dates have the month first"),
        ("Date/Time", ["3.4.2025 23:00:00", "4.4.2025 01:00:00"], [0, 2], "first row"),
    ],
)
def test_clock_times(name: str, cells: list[str], hours: list[float], assumed: str, tmp_path: Path):
    history = read(name, cells, tmp_path / "x.csv")
    np.testing.assert_allclose(history.times / 3600, hours, rtol=1e-12)
    assert assumed in history.labels["assumed"]


@pytest.mark.parametrize(("order", "days"), [("day first", 31), ("month first", 1)])
def test_the_order_of_dates_is_asked_for(order: str, days: int, tmp_path: Path):
    cells = ["3/4/2025 08:00:00", "3/5/2025 08:00:00"] if order == "month first" else ["4/3/2025", "4/4/2025"]
    both = ["3/4/2025 08:00:00", "4/5/2025 08:00:00"]
    with pytest.raises(HistoryError, match="may have the month or the day first, .* state date_order, 'month first'"):
        read("Time", both, tmp_path / "x.csv")
    history = read("Time", cells, tmp_path / "y.csv", f"# date_order: {order}\n")
    assert history.times[-1] == days * 86400


REFUSED = [
    ("Time", ["08:30:00", "09:30:00"], "", "begins at 08:30:00, which may be elapsed or of the day; name the column"),
    ("Time (h)", ["0:30:00", "1:30:00"], "", "'Time .h.' is in h, and its first cell is '0:30:00', a time of a clock"),
    ("Time", ["0:30:00", "2.5"], "", "'Time' is '2.5'; write h:mm:ss as in the rows before"),
    ("Time", ["0:30:00", "0:20:00"], "", "time falls from 1800 s to 1200 s"),
    ("time_s", ["0", "1"], "# date_order: day first\n", "x.csv:3: date_order says nothing here"),
    ("Time", ["0:30:00", "1:30:00"], "# date_order: mdy\n", "x.csv:3: date_order is 'mdy'; allowed: month first"),
    ("Time", ["1:30", "2:30"], "", "time is '1:30'; write h:mm:ss"),
    ("Time", ["2025-03-04 08:00:00", "2025-03-04 07:00:00"], "", "time falls by 3600 s"),
]


def test_what_is_refused(tmp_path: Path):
    for name, cells, head, message in REFUSED:
        with pytest.raises(HistoryError, match=message) as caught:
            read(name, cells, tmp_path / "x.csv", head)
        assert ("x.csv" in str(caught.value), "\n" in str(caught.value)) == (True, False)


def test_cells_of_a_spreadsheet(tmp_path: Path):
    """A spreadsheet keeps an elapsed time above a day as a day of the year 1900."""
    for name, times in (
        ("durations", [timedelta(hours=7 * k) for k in range(6)]),
        ("stamps", [datetime(2025, 3, 4, 8) + timedelta(hours=7 * k) for k in range(6)]),
        ("days", [0.0, *(datetime(1899, 12, 31) + timedelta(hours=24 + 7 * k) for k in range(5))]),
    ):
        frames = [[timedelta(0) if time == 0.0 else time, 0.3 * k] for k, time in enumerate(times)]
        rows = [["# stress_MPa: 60"], ["# temperature_C: 850"], ["Time", "Strain (%)"], *frames]
        (history,) = ck.read_histories(workbook(tmp_path / f"{name}.xlsx", {"S": rows}))
        expected = [7.0 * k for k in range(6)] if name != "days" else [0, *(24 + 7.0 * k for k in range(5))]
        np.testing.assert_allclose(history.times / 3600, expected, rtol=1e-9, err_msg=name)


@pytest.mark.parametrize("first_day", [datetime(1899, 12, 30), datetime(1904, 1, 1)])
def test_months_on_the_clock_of_a_spreadsheet(first_day: datetime, tmp_path: Path):
    """As numbers of days shown as h:mm:ss: the 60th is the 29th of February 1900, which was none."""
    book, days = Workbook(), [0, 0.25, 1, 30, 59, 59.5, 60, 60.5, 61, 100, 400]
    book.epoch = first_day
    book.active.append(["Time", "Strain (%)"])
    for row, day in enumerate(days, 2):
        book.active.append([day, 0.001 * day + 0.02])
        book.active.cell(row, 1).number_format = "hh:mm:ss"
    book.save(tmp_path / "long 60 MPa 850C.xlsx")
    (history,) = ck.read_histories(tmp_path / "long 60 MPa 850C.xlsx")
    np.testing.assert_allclose(history.times / 86400, days, rtol=1e-9)
