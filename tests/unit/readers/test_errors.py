"""Every way in which a file can be wrong is told in one sentence, with the file and the line."""

import re
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.quality import check_data_quality
from creepkit.readers.history_csv import HISTORY_CSV
from creepkit.readers.indexed_folders import INDEXED_TABLE
from creepkit.readers.names import NAME_SYNONYMS
from creepkit.readers.tests_in_rows import TEST_TABLE
from creepkit.readers.vocabulary import HeaderVocabulary, plain_name
from creepkit.records import History
from creepkit.records.quantities import LENGTH
from helpers.misspellings import misspelt_keys
from helpers.workbooks import workbook

HEAD = "# temperature_C: 850\n# stress_MPa: 60\n"
BODY = "time_s,strain_1\n0,0\n10,0.1\n"

CASES = [
    ("", "x.csv: the file is empty; write a line of columns such as time_s,strain_pct, then rows"),
    (HEAD, "x.csv: the file holds a header but no table"),
    (HEAD + "time_s,strain_1\n", "x.csv:3: no rows below the line of columns"),
    (HEAD + "time_s,strain_1\n0,0\n", "x.csv:4: only one frame in time; at least two are needed"),
    (HEAD + "strain\n0\n1\n", "x.csv:3: missing column: no time among strain; name one time_s, time_min"),
    (HEAD + "time_s,temperature_C\n0,850\n1,850\n", "x.csv:3: missing column: no output of a specimen"),
    (HEAD + "time_s,strain_1,shape\n0,0,2\n1,0,2\n", "x.csv:3: a column of shape has no meaning beside strain, stress"),
    (HEAD + "time_s,strain_1,used\n0,0,1\n1,.5,.5\n", "x.csv:5: 'used' is 0.5; allowed: 1 for a frame"),
    (HEAD + "# specimen: bulge\n" + BODY, "x.csv:4: .* no output of 'bulge' .*found: outputs of point and uniaxial"),
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
    (HEAD + "time_s,strain_1\n1'25,0\n2.25,.2\n3,.3\n", "x.csv:4: 'time_s' is '1'25', with digits in groups"),
    (HEAD + "time_s,strain_1\n0,0\n\n1\n", "x.csv:6: number of cells 1, of columns 2; write one cell a column"),
    (HEAD + 'time_s,strain_1\n0,"0\n1,0\n', "x.csv:4: not a line of a CSV table .*; look for stray"),
    (HEAD + "time_s,strain_1,strain_1\n0,0,0\n", "x.csv:3: the column 'strain_1' stands there twice"),
    (HEAD + "time_s,time_h,strain_1\n0,0,0\n",
     r"x.csv:3: 'time_s' and 'time_h' both hold the time; which counts\? .* columns = {time_h = \"unused\"}"),
    (HEAD + "time_s,,strain\n0,0,0\n", "x.csv:3: a column has no name"),
    ("# temperature_C: 850\n# label furnace: 4\n" + BODY,
     r"x.csv: no loading \(no .*stress\) \(kept as labels: furnace\); write .*stress_MPa, or stress_steps"),
    ("# temperature_C: 850\n# stres_MPa: 60\n" + BODY,
     r"x.csv:2: unknown key 'stres_MPa'; did you mean 'stress_MPa'\? A label is written 'label stres_MPa'"),
    ("# stress_MPa: 60\n" + BODY, "x.csv: no temperature; write temperature_C or temperature_K"),
    ("# temperature_C: 850\n# stress_MPa: -2e5\n" + BODY,
     "x.csv:2: 'stress_MPa' is -200000; a stress must lie from -100000 to 100000 MPa"),
    ("# temperature_C: -300\n# stress_MPa: 60\n" + BODY,
     "x.csv:1: 'temperature_C' is -300; a temperature must lie above 0 and below 4500 K"),
    (HEAD + "# modulus_GPa: 0\n" + BODY, "x.csv:3: 'modulus_GPa' is 0; a modulus must lie above 0"),
    (HEAD + "# stress_MPa: 61\n" + BODY, "x.csv:3: 'stress_MPa' was already given in line 2; keep one of them"),
    (HEAD + "# temperature_K: 1123.15\n" + BODY, r"x.csv:3: 'temperature' is given twice \(perhaps in two units\)"),
    (HEAD + "# stress_steps: 0 s 60 MPa\n" + BODY,
     "x.csv: the stress is given 2 times, as a number, stress_steps or stress_program; keep one"),
    (HEAD + "# pressure_MPa: 8\n" + BODY, "x.csv:3: 'pressure_MPa' has no meaning beside the others"),
    (HEAD + "time_s,strain_1,pressure_MPa\n0,0,8\n1,0,8\n",
     "x.csv:3: a column of pressure has no meaning beside strain, stress, temperature"),
    ("# temperature_C: 850\n# pressure_1_MPa: 8\n# pressure_2_MPa: 8\n" + BODY,
     "x.csv:2: 'pressure_1_MPa' needs jump_time beside it .*, which is missing"),
    ("# temperature_C: 850\n# pressure_1_MPa: 8\n# pressure_2_MPa: 8\n# jump_time_s: 1\n" + BODY,
     "x.csv:2: a pressure jump needs .* Tj after the first ramp"),
    (HEAD + "# jump_time_h: 3\n" + BODY, "x.csv:3: 'jump_time_h' has no meaning beside"),
    ("# temperature_C: 850\n# stress_steps: 0 s 60 MPa, 5 s 70 MPa\n" + BODY,
     "x.csv:2: stress_steps holds '0 s 60 MPa, 5 s 70 MPa'; write time and value with units: 0 s 100 MPa"),
    ("# temperature_C: 850\n# stress_steps: 5 s 60 MPa\n" + BODY,
     "x.csv:2: the times of stress_steps are 5 s; they must start at 0 and never decrease"),
    ("# temperature_C: 850\n# stress_steps: 0 s 60 MPa; 0 s 61 MPa\n" + BODY,
     "x.csv:2: stress steps must start at time 0 and follow one another"),
    ("# temperature_C: 850\n# stress_steps: 0 s 60 N\n" + BODY,
     "x.csv:2: the unit 'N' of 'stress_steps' is not understood; allowed: MPa, kPa"),
    (HEAD + "# control: force\n" + BODY, "x.csv:3: control is 'force'; allowed: load, stress"),
    (HEAD + "# strain_measure: large\n" + BODY, "x.csv:3: strain_measure is 'large'; allowed: eng"),
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


# ---- contradictions --------------------------------------------------------------------------------------------------

# What a file says twice, or cannot mean, is refused: units, durations beside rupture times, marks of frames.


TABLE_HEAD = "# stress_MPa: 100\n# temperature_C: 800\n"


def read(path: Path, text: str) -> list[History]:
    path.write_text(text)
    return HISTORY_CSV.read(path)


def test_a_strain_without_unit_above_100_is_asked_for(tmp_path: Path):
    body = "time_h,strain\n0,0\n1,500\n2,1200\n"
    with pytest.raises(HistoryError, match="bar.csv:3: 'strain' has no unit, and values up to 1200 .*microstrain"):
        read(tmp_path / "bar.csv", TABLE_HEAD + body)
    (history,) = read(tmp_path / "bar.csv", TABLE_HEAD + "# strain_unit: microstrain\n" + body)
    assert history.outputs["strain"][-1] == pytest.approx(1.2e-3)


def test_a_strain_above_one_is_flagged(tmp_path: Path):
    (history,) = read(tmp_path / "bar.csv", TABLE_HEAD + "time_h,strain_1\n0,0\n1,0.5\n2,1.2\n")
    (flag,) = [one for one in check_data_quality([history]) if one.kind == "unit"]
    assert "the strain reaches 120 %" in str(flag)


def test_a_unit_behind_a_value_that_is_not_that_of_its_name(tmp_path: Path):
    body = "Stress (MPa);100;{}\nTemperature (C);800;{}\nTime (h);Strain (%)\n0;0\n1;0,5\n2;0,9\n"
    (history,) = read(tmp_path / "bar.csv", body.format("MPa", "°C"))
    assert history.condition == "800 °C, 100 MPa"
    for units in (("ksi", "C"), ("MPa", "K")):
        with pytest.raises(HistoryError, match=r"bar.csv:[12]: '(Stress|Temp).* behind its value; keep one"):
            read(tmp_path / "bar.csv", body.format(*units))


@pytest.mark.parametrize(("duration", "is_refused"), [("9.5", False), ("9.52", False), ("100", True), ("5", True)])
def test_a_duration_beside_a_rupture_time(tmp_path: Path, duration: str, is_refused: bool):
    path = tmp_path / "table.csv"
    path.write_text(f"no,Stress (MPa),T (C),tr (h),duration (h)\n1,120,750,9.5,{duration}\n")
    if is_refused:
        with pytest.raises(HistoryError, match=rf"table.csv:2: 'tr \(h\)' is 9.5, and 'duration \(h\)' is {duration}"):
            TEST_TABLE.read(path)
    else:
        assert TEST_TABLE.read(path)[0].rupture_time == pytest.approx(9.5 * 3600)


# ---- closed vocabulary -----------------------------------------------------------------------------------------------

# A key that is not known is an error that says what to write; nothing becomes a label that is not called one.


ROWS = "time_s,strain_pct\n0,0\n10,0.1\n"
BULGE = "# specimen: bulge\n# temperature_C: 850\n# pressure_MPa: 8\n{}\ntime_s,amplitude_mm\n10,0.1\n20,0.11\n"
BAR = "# temperature_C: 850\n# stress_MPa: 60\n{}\ntime_s,strain_pct\n0,0\n10,0.1\n"


def spelled(specimen: str) -> dict[str, str]:
    return {plain_name(key): key for key in HeaderVocabulary().terms(specimen).head_keys()}


def read_text_of(text: str, path: Path) -> History:
    path.write_text(text, encoding="utf-8")
    (history,) = HISTORY_CSV.read(path)
    return history


@pytest.mark.parametrize(("template", "specimen"), [(BAR, ""), (BULGE, "bulge")], ids=["bar", "dimple"])
def test_none_of_600_misspelt_keys_is_accepted(template: str, specimen: str, tmp_path: Path):
    """300 in each file, of one or two edits or with another unit; each is refused by its own name."""
    spellings = spelled(specimen)
    known = {plain_name(f"{name}_{unit}") for name in NAME_SYNONYMS for unit in LENGTH.units} | {*spellings}
    for key, wrong in misspelt_keys(spellings.values(), 300, 617, known):
        value = "7" if "_" in key else "X7"
        with pytest.raises(HistoryError) as caught:
            read_text_of(template.format(f"# {wrong}: {value}"), tmp_path / "x.csv")
        named = [plain_name(text) for text in str(caught.value).split("'")[1::2]]
        base = plain_name(wrong.rpartition("_")[0] or wrong)  # a length is named without its unit
        assert {plain_name(wrong), base} & set(named), (key, wrong, str(caught.value))
        assert "\n" not in str(caught.value)


def test_the_names_of_a_laboratory_are_misspelt_as_well(tmp_path: Path):
    """A column `yongs_MPa` was a label, and the test was read without its modulus."""
    (tmp_path / "curves.csv").write_text("key,time_s,strain_pct\na,0,0\na,10,0.1\n")
    (tmp_path / "index.csv").write_text("key,temperature_C,stress_MPa,yongs_MPa\na,850,60,150000\n")
    with pytest.raises(HistoryError, match="unknown key 'yongs_MPa'; did you mean 'youngs_MPa'"):
        INDEXED_TABLE.read(tmp_path)


def test_an_index_refuses_misspelt_columns_too(tmp_path: Path):
    """A column of an index that resembles no key is a label; a misspelt key of seven letters or more is an error."""
    spellings = spelled("")
    keys = [key for key in spelled("uniaxial").values() if len(key) >= 7]
    (tmp_path / "curves.csv").write_text("key,time_s,strain_pct\na,0,0\na,10,0.1\n")
    index = "key,temperature_C,stress_MPa,{}\na,850,60,7\n"
    accepted, refused = [], 0
    for key, wrong in misspelt_keys(keys, 200, 96, spellings):
        (tmp_path / "index.csv").write_text(index.format(f'"{wrong}"'))
        try:
            accepted += [(key, wrong, dict(h.labels)) for h in INDEXED_TABLE.read(tmp_path)]
        except HistoryError as error:
            refused += str(error).startswith(str(tmp_path / "index.csv"))
    assert (accepted, refused) == ([], 200)
    (tmp_path / "index.csv").write_text(index.format("grain_size_um"))
    assert INDEXED_TABLE.read(tmp_path)[0].labels["grain_size_um"] == "7"


def test_capitals_blanks_hyphens_and_brackets_do_not_matter(tmp_path: Path):
    head = (
        "# Temperature [C]: 850\n# STRESS (MPa): 60\n# Strain-Measure: logarithmic\n# includes elastic: no\n"
        "# Control: load\n# Specimen: Uniaxial\n# Modulus, GPa: 150\n"
    )
    history = read_text_of(head + ROWS, tmp_path / "x.csv")
    plain = "# temperature_C: 850\n# stress_MPa: 60\n# strain_measure: logarithmic\n# includes_elastic: no\n"
    expected = read_text_of(plain + "# control: load\n# modulus_GPa: 150\n" + ROWS, tmp_path / "x.csv")
    assert (history.temperature, history.loading) == (expected.temperature, expected.loading)
    assert (history.elastic, history.strain_measure, history.specimen) == (expected.elastic, "logarithmic", "uniaxial")
    assert dict(history.labels) == {}


# ---- decimal signs ---------------------------------------------------------------------------------------------------

# The decimal sign of a table holds for all that stands in it: run-outs, steps and correlations too.


FRAMES = "# temperature_C: 800\n# control: load\n{}\ntime_h;strain_pct\n0;0\n100;0,5\n900;0,9\n"


@pytest.mark.parametrize("cell", [">10.000", "10.000", ">=10.000"])
def test_a_run_out_with_a_point_of_thousands_is_refused(tmp_path: Path, cell: str):
    path = tmp_path / "table.csv"
    path.write_text(f"test;stress_MPa;temperature_C;rupture (h)\nA1;120,5;750;8200,5\nA2;100,5;750;{cell}\n")
    with pytest.raises(HistoryError, match=r"table.csv:3: 'rupture \(h\)' is '10.000' with a point"):
        TEST_TABLE.read(path)
    path.write_text(path.read_text().replace(cell, cell.replace(".", ",")))
    duration = TEST_TABLE.read(path)[1].times[-1]
    assert duration == pytest.approx(36000.0)


@pytest.mark.parametrize("line", ["steps: 0 s 1.000 MPa; 1 h 9 MPa", "program: 0 s 5 MPa; 1.500 h 9 MPa"])
def test_steps_with_a_point_of_thousands_are_refused(tmp_path: Path, line: str):
    path = tmp_path / "bar.csv"
    path.write_text(FRAMES.format(f"# stress_{line}"))
    with pytest.raises(HistoryError, match=r"bar.csv:3: .* with a point, while the table has decimal commas"):
        HISTORY_CSV.read(path)


def test_steps_with_decimal_commas_or_a_plain_point(tmp_path: Path):
    path = tmp_path / "bar.csv"
    for word in ("1,5", "1.5"):
        path.write_text(FRAMES.format(f"# stress_steps: 0 s 100 MPa; {word} h 120 MPa"))
        (history,) = HISTORY_CSV.read(path)
        np.testing.assert_allclose(history.loading.steps, [(0.0, 100.0), (5400.0, 120.0)])


def test_exponents_of_fortran_are_numbers(tmp_path: Path):
    path, times = tmp_path / "dip.dat", [0.0, 20.0, 24.1251, 137.5]
    for letter in "DdE":
        rows = [f" {t:.5E}  6.00000E+01  {1e-4 + 1e-6 * t:.5E}".replace("E", letter) for t in times]
        path.write_text(
            "# temperature_K: 673\n# control: stress\ntime_s stress_MPa strain_1\n" + "\n".join(rows) + "\n"
        )
        (history,) = HISTORY_CSV.read(path)
        np.testing.assert_array_equal(history.times, times)
        np.testing.assert_allclose(history.outputs["strain"], 1e-4 + 1e-6 * np.array(times), atol=1e-9)
        assert history.loading.steps == ((0.0, 60.0),)
    path.write_text("test;T (C);stress (MPa);min rate (1/h)\nA;600;1.2D+02;1.0d-05\n")
    (row,) = TEST_TABLE.read(path)
    assert (row.minimum_rate, row.loading.steps) == (pytest.approx(1e-5 / 3600), ((0.0, 120.0),))


def test_texts_of_a_sheet_decide_about_their_decimal_sign(tmp_path: Path):
    head = [["Prüftemperatur", "540,5 °C"], ["E-Modul", "172,25 GPa"], ["Gesamtdehnung", "0,10 %"], ["Los", "3,004 kg"]]
    sheet = [*head, [], ["Zeit (h)", "Restspannung (MPa)"], [0, 170.5], [100.25, "151,5"], [1000, 128.5]]
    (history,) = ck.read_histories(workbook(tmp_path / "r.xlsx", {"Schraube": sheet}))
    assert history.temperature == pytest.approx(813.65)
    assert history.loading.program().values.tolist() == pytest.approx([0.001])
    assert history.elastic.at(history.temperature).E == pytest.approx(172250.0)
    assert history.outputs["stress"].tolist() == [170.5, 151.5, 128.5]
    np.testing.assert_allclose(history.times, [0.0, 360900.0, 3600000.0])


def test_an_empty_folder_says_what_belongs_there(tmp_path):
    with pytest.raises(HistoryError, match=r"the folder holds no file of tests; put tables there \(\.csv"):
        ck.read_histories(tmp_path)
