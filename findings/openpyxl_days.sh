#!/usr/bin/env bash
# openpyxl: the clock of a test of three months, kept as days and shown as hh:mm:ss
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet openpyxl==3.1.5 XlsxWriter==3.3.1
cd "$folder"
env/bin/python - <<'PYTHON'
from datetime import datetime, time, timedelta
from importlib.metadata import version

import openpyxl
import xlsxwriter

days = [0.5, 1.0, 59.0, 59.5, 60.0, 60.5, 61.0, 90.0]
with xlsxwriter.Workbook("creep.xlsx") as book:
    clock = book.add_format({"num_format": "hh:mm:ss"})
    book.add_worksheet().write_column(0, 0, days, clock)
cells = [row[0].value for row in openpyxl.load_workbook("creep.xlsx").active.iter_rows()]


def elapsed(value: time | datetime) -> float:
    """Days since the day before the first of January 1900, which stands for day 1."""
    if isinstance(value, time):
        return timedelta(hours=value.hour, minutes=value.minute, seconds=value.second) / timedelta(days=1)
    return (value - datetime(1899, 12, 31)) / timedelta(days=1)


print(f"openpyxl {version('openpyxl')}; cells written by XlsxWriter {version('XlsxWriter')} as numbers of days shown as hh:mm:ss")
for day, cell in zip(days, cells):
    print(f"{day:5} days -> {cell!r:38} {elapsed(cell):5} days")
print("A good guess: half a day is a time and a day is the first of January 1900, so days are counted from the day before,")
print("and different cells are different times. Seen: the 60th day, a 29th of February 1900 that spreadsheets count though")
print("there was none, is read as the 59th, and all later days are one short. Format [h]:mm:ss gives durations without it.")
seen = [elapsed(cell) for cell in cells] == [0.5, 1.0, 59.0, 59.5, 59.0, 59.5, 60.0, 89.0]
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
