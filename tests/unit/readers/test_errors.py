"""Every way in which a file can be wrong is told in one sentence, with the file and the line."""

import re
from pathlib import Path

import pytest

from creepkit.errors import HistoryError
from creepkit.readers.history_csv import HISTORY_CSV

HEAD = "# temperature_C: 850\n# stress_MPa: 60\n"
BODY = "time_s,strain_1\n0,0\n10,0.1\n"

CASES = [
    ("", "x.csv: the file is empty; write a line of columns such as time_s,strain_pct, then rows"),
    ("\n \n", "x.csv: the file is empty"),
    (HEAD, "x.csv: the file holds a header but no table"),
    (HEAD + "time_s,strain_1\n", "x.csv:3: no rows below the line of columns"),
    (HEAD + "time_s,strain_1\n0,0\n", "x.csv:4: only one frame in time; at least two are needed"),
    (HEAD + "time_s,strain_1\n1,0\n1,1\n", "x.csv:4: only one frame in time"),
    (HEAD + "strain\n0\n1\n", "x.csv:3: missing column: no time among strain; name one time_s, time_min"),
    (HEAD + "time_s,temperature_C\n0,850\n1,850\n", "x.csv:3: missing column: no output of a specimen"),
    (HEAD + "time_s,strain_1,shape\n0,0,2\n1,0,2\n", "x.csv:3: a column of shape has no meaning beside strain, stress"),
    (HEAD + "# specimen: bulge\n" + BODY, "x.csv:4: .* outputs of point and uniaxial, those of bulge are"),
    (HEAD + "time_s,strian\n0,0\n1,0\n", "x.csv:3: column 'strian' is not understood; did you mean 'strain'"),
    (HEAD + "time_yr,strain_1\n0,0\n1,0\n",
     "x.csv:3: the unit 'yr' of 'time_yr' is not understood; allowed: time_s, time_min, time_h, time_d"),
    (HEAD + "time_s,strain_ppm\n0,0\n1,0\n",
     "x.csv:3: the unit 'ppm' of 'strain_ppm' is not understood; allowed: strain, strain_1, strain_pct"),
    (HEAD + "time,strain\n0,0\n1,0\n", "x.csv:3: 'time' has no unit; allowed: time_s, time_min"),
    ("# temperature_R: 1600\n# stress_MPa: 60\n" + BODY,
     "x.csv:1: the unit 'R' of 'temperature_R' is not understood; allowed: temperature_K, temperature_C"),
    ("# temperature: 850\n" + BODY, "x.csv:1: 'temperature' has no unit; allowed: temperature_K, temperature_C"),
    (HEAD + "time_s,strain_1\n0,0\n10,0.1\n9,0.2\n", "x.csv:6: time falls from 10 s to 9 s; it must never decrease"),
    (HEAD + "time_s,strain_1\n-1,0\n1,0\n", "x.csv:4: 'time_s' is -1; a time must lie from 0 to 1e"),
    (HEAD + "time_s,strain_1\n0,0\n1,nan\n", "x.csv:5: 'strain_1' is 'nan'; write a finite number"),
    (HEAD + "time_s,strain_1\n0,0\n1,1e999\n", "x.csv:5: 'strain_1' is '1e999', too large"),
    (HEAD + "time_s,strain_1\n0,0\n1,a lot\n", "x.csv:5: 'strain_1' is 'a lot'; write a finite number"),
    (HEAD + "time_s,strain_1\n0,0\n1_000,0\n", "x.csv:5: 'time_s' is '1_000'; write a finite number"),
    (HEAD + "time_s,strain_1\n0,0\n1,\n", "x.csv:5: 'strain_1' is empty; write a finite number"),
    (HEAD + "time_s,strain_1\n0,0\n\n1\n", "x.csv:6: number of cells 1, of columns 2; write one cell a column"),
    (HEAD + "time_s,strain_1\n0,0,0\n", "x.csv:4: number of cells 3, of columns 2"),
    (HEAD + 'time_s,strain_1\n0,"0\n1,0\n', "x.csv:4: not a line of a CSV table .*; look for stray"),
    (HEAD + "time_s,strain_1,strain_1\n0,0,0\n", "x.csv:3: the column 'strain_1' stands there twice"),
    (HEAD + "time_s,time_h,strain_1\n0,0,0\n",
     r"x.csv:3: 'time_s' and 'time_h' both hold the time; which counts\? .* columns = {time_h = \"unused\"}"),
    (HEAD + "time_s,,strain\n0,0,0\n", "x.csv:3: a column has no name"),
    ("# temperature_C: 850\n# label furnace: 4\n" + BODY,
     r"x.csv: no loading \(no .*stress\) \(kept as labels: furnace\); write .*stress_MPa, stress_steps"),
    ("# temperature_C: 850\n# stres_MPa: 60\n" + BODY,
     r"x.csv:2: unknown key 'stres_MPa'; did you mean 'stress_MPa'\? A label is written 'label stres_MPa'"),
    ("# stress_MPa: 60\n" + BODY, "x.csv: no temperature; write temperature_C or temperature_K"),
    ("# temperature_C: 850\n# stress_MPa: -60\n" + BODY,
     "x.csv:2: 'stress_MPa' is -60; a stress must lie from 0 to 100000 MPa"),
    ("# temperature_C: -300\n# stress_MPa: 60\n" + BODY,
     "x.csv:1: 'temperature_C' is -300; a temperature must lie above 0 and below 4500 K"),
    (HEAD + "# modulus_GPa: 0\n" + BODY, "x.csv:3: 'modulus_GPa' is 0; a modulus must lie above 0"),
    (HEAD + "# stress_MPa: 61\n" + BODY, "x.csv:3: 'stress_MPa' was already given in line 2; keep one of them"),
    (HEAD + "# temperature_K: 1123.15\n" + BODY, r"x.csv:3: 'temperature' is given twice \(perhaps in two units\)"),
    (HEAD + "# stress_steps: 0 s 60 MPa\n" + BODY,
     "x.csv: the stress is given 2 times over, as a number, stress_steps or stress_program; keep one"),
    (HEAD + "# pressure_MPa: 8\n" + BODY, "x.csv:3: 'pressure_MPa' has no meaning beside the other conditions"),
    (HEAD + "time_s,strain_1,pressure_MPa\n0,0,8\n1,0,8\n",
     "x.csv:3: a column of pressure has no meaning beside strain, stress, temperature"),
    ("# temperature_C: 850\n# pressure_1_MPa: 8\n# pressure_2_MPa: 8\n" + BODY,
     "x.csv:2: 'pressure_1_MPa' needs jump_time beside it .*, which is missing"),
    ("# temperature_C: 850\n# pressure_1_MPa: 8\n# pressure_2_MPa: 8\n# jump_time_s: 1\n" + BODY,
     "x.csv:2: a pressure jump needs .* Tj after the first ramp"),
    (HEAD + "# jump_time_h: 3\n" + BODY, "x.csv:3: 'jump_time_h' has no meaning beside"),
    ("# temperature_C: 850\n# stress_steps: 0 s 60 MPa, 5 s 70 MPa\n" + BODY,
     "x.csv:2: stress_steps holds '0 s 60 MPa, 5 s 70 MPa'; write time and value with units, such as 0 s 100 MPa"),
    ("# temperature_C: 850\n# stress_steps: 5 s 60 MPa\n" + BODY,
     "x.csv:2: the times of stress_steps are 5 s; they must start at 0 and never decrease"),
    ("# temperature_C: 850\n# stress_steps: 0 s 60 MPa; 0 s 61 MPa\n" + BODY,
     "x.csv:2: stress steps must start at time 0 and follow one another"),
    ("# temperature_C: 850\n# stress_steps: 0 s 60 N\n" + BODY,
     "x.csv:2: the unit 'N' of 'stress_steps' is not understood; allowed: MPa, kPa"),
    (HEAD + "# control: force\n" + BODY, "x.csv:3: control is 'force'; allowed: load, stress"),
    (HEAD + "# strain_measure: true\n" + BODY, "x.csv:3: strain_measure is 'true'; allowed: eng"),
    (HEAD + "# end_time_s: 1\ntime_s,strain_1\n2,0\n3,0\n", "x.csv:3: every frame lies after"),
    (HEAD + "# strain_sd_1: 0\n" + BODY, "x.csv:3: 'strain_sd_1' is 0; a standard deviation of a"),
    (HEAD + "# strain_sd_1: 1\ntime_s,strain_1,strain_sd_1\n0,0,1\n1,0,1\n",
     "x.csv:3: 'strain_sd_1' is also a column of the frames"),
    (HEAD + "time_s,strain_1,used\n0,0,1\n1,0,2\n", "x.csv:5: 'used' is 2; a flag must lie from 0 to 1"),
]  # fmt: skip


def test_each_mistake_is_told_with_its_line(tmp_path: Path):
    path, wrong = tmp_path / "x.csv", []
    for text, message in CASES:
        path.write_text(text, encoding="utf-8")
        try:
            HISTORY_CSV.read(path)
        except HistoryError as error:
            if not re.search(message, str(error)) or "\n" in str(error):
                wrong.append(f"'{message}' is not in: {error}")
        else:
            wrong.append(f"nothing was said of '{message}'")
    assert wrong == []


def test_bytes_that_are_no_text(tmp_path: Path):
    path = tmp_path / "x.csv"
    path.write_bytes(b"# alloy: a\n# heat: \x01\xb0\n")
    with pytest.raises(
        HistoryError, match=r"x.csv:2: byte 0x01 is not text in UTF-8 or Latin-1; save it as CSV in UTF-8"
    ):
        HISTORY_CSV.read(path)


def test_file_that_is_not_there(tmp_path: Path):
    with pytest.raises(HistoryError, match=r"x.csv: there is no such file"):
        HISTORY_CSV.read(tmp_path / "x.csv")
