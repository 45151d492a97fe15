#!/usr/bin/env bash
# pyexcel-ods and fastexcel: the time column of one OpenDocument sheet
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet pyexcel-ods==0.6.0 pyexcel-io==0.6.8 fastexcel==0.21.0 polars==2.1.0 odfpy==1.4.1
cd "$folder"
env/bin/python - <<'PYTHON'
from datetime import time, timedelta
from importlib.metadata import version

import fastexcel
import pyexcel_ods
from odf.opendocument import OpenDocumentSpreadsheet
from odf.table import Table, TableCell, TableRow
from odf.text import P

# Times since loading as cells of the kind "time", in the durations that OpenDocument 1.3 takes from XML Schema.
times = {"PT00H00M10S": 10, "PT00H00M10.500000000S": 10.5, "PT23H59M59S": 86399, "PT30H00M00S": 108000, "PT720H30M15S": 2593815}
times["PT720H30M15.250000000S"] = 2593815.25
document, sheet = OpenDocumentSpreadsheet(), Table(name="creep")
for duration in times:
    row = TableRow()
    for cell in (TableCell(valuetype="time", timevalue=duration), TableCell(valuetype="float", value="0.0012")):
        cell.addElement(P(text="as shown"))
        row.addElement(cell)
    sheet.addElement(row)
document.spreadsheet.addElement(sheet)
document.save("creep.ods")


def seconds(value):
    if isinstance(value, time):
        return timedelta(hours=value.hour, minutes=value.minute, seconds=value.second, microseconds=value.microsecond).total_seconds()
    return value.total_seconds() if isinstance(value, timedelta) else value


first = [seconds(row[0]) for row in pyexcel_ods.get_data("creep.ods")["creep"]]
frame = fastexcel.read_excel("creep.ods").load_sheet(0, header_row=None).to_polars()
second = [seconds(value) for value in frame[frame.columns[0]].to_list()]
print(f"pyexcel-ods {version('pyexcel-ods')} and fastexcel {version('fastexcel')}, one sheet, seconds of its time column:")
for (duration, true), one, two in zip(times.items(), first, second):
    print(f"  {duration:24} is {true:12}; pyexcel-ods {one!s:>10}, fastexcel {two!s:>8}")
print(f"fastexcel gives that column the type {frame.dtypes[0]}")
print("A good guess: both give each as a duration, as fastexcel does with a workbook of Excel that has these times. Seen: pyexcel-ods")
print("leaves out each time with a fraction of a second, so that a reading has no time, and fastexcel each of a day or longer,")
print("which is most of a creep test; no word from either. What one loses the other has, but for days with a fraction.")
expected_first = [None if true % 1 else true for true in times.values()]
expected_second = [None if true >= 86400 else true for true in times.values()]
raise SystemExit(0 if first == expected_first and second == expected_second else "changed: this is no longer what happens")
PYTHON
