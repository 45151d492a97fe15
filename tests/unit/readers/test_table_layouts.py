"""The same two tests in every layout: as text in many dialects, side by side, in sheets; and what is asked for."""

from collections.abc import Callable, Sequence
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.readers.history_csv import HISTORY_CSV
from creepkit.records import History

TIMES, STRAINS = (0.0, 0.5, 1.25, 1000.5), (0.0, 0.012, 0.0255, 1.5e-1)
"""h, and per cent."""


Read = Callable[..., list[History]]


@pytest.fixture
def read(tmp_path: Path) -> Read:
    def histories(text: str, encoding: str = "utf-8", name: str = "x.csv") -> list[History]:
        path = tmp_path / name
        path.write_bytes(text.encode(encoding))
        assert HISTORY_CSV.accepts(path)
        return HISTORY_CSV.read(path)

    return histories


def joined(rows: Sequence[Sequence[object]], delimiter: str, decimal: str) -> str:
    return "".join(
        delimiter.join(str(c).replace(".", decimal) if isinstance(c, float) else str(c) for c in row) + "\n"
        for row in rows
    )


DIALECTS = [
    (delimiter, decimal, encoding)
    for delimiter, decimal, encoding in product(",;\t| ", ".,", ("utf-8", "utf-8-sig", "utf-16", "latin-1"))
    if (delimiter, decimal) != (",", ",")
]


@pytest.mark.parametrize(("delimiter", "decimal", "encoding"), DIALECTS)
def test_one_test_reads_the_same_in_every_dialect(read, delimiter: str, decimal: str, encoding: str):
    head = "# label Messung: Temperatur in °C\n# temperature_C: 850\n# stress_MPa: 60\n"
    names = ["Time_(h)", "Strain_[%]"] if delimiter == " " else ["Time (h)", "Strain [%]"]
    body = joined([names, *zip(TIMES, STRAINS, strict=True)], delimiter, decimal)
    (history,) = read(head + body, encoding)
    np.testing.assert_array_equal(history.times, 3600.0 * np.array(TIMES))
    np.testing.assert_array_equal(history.outputs["strain"], 0.01 * np.array(STRAINS))
    assert history.condition == "850 °C, 60 MPa"


@pytest.mark.parametrize(
    ("names", "factor"),
    [
        ("Time (h),Strain [%]", 1.0),
        ("time/h,ε / %", 1.0),
        ("Elapsed time in hours,Creep strain (%)", 1.0),
        ("t_h,STRAIN_PCT", 1.0),
        ("TIME [H],strain percent", 1.0),
        ('"Time, h","Strain, %"', 1.0),
        ("Time,Strain\nh,%", 1.0),
        ("Time,Strain\n[h],(mm/mm)", 100.0),
        ("t (min),Strain (microstrain)", 1e-4),
    ],
)
def test_names_with_units(read, names: str, factor: float):
    (history,) = read(f"# temperature_C: 850\n# stress_MPa: 60\n{names}\n0,0\n60,0.3\n")
    assert history.times[1] == (3600.0 if "min" in names else 216000.0)
    assert history.outputs["strain"][1] == pytest.approx(0.003 * factor, rel=1e-15)


@pytest.mark.parametrize(
    ("entry", "kelvin", "stress"),
    [
        ("# T_F: 1562\n# stress_ksi: 10", 1123.15, 68.94757293168361),
        ("# Temperature (°C): 850\n# Stress: 60 MPa", 1123.15, 60.0),
        ("# Temperature / °F: 1562\n# applied stress [psi]: 10000", 1123.15, 68.94757293168361),
        ("# TEMPERATURE: 1123.15 K\n# σ / MPa: 60", 1123.15, 60.0),
        ("Temperature,850,°C\nStress (N/mm2),60", 1123.15, 60.0),
        ("Temperature: 850 °C\nStress (MPa),60", 1123.15, 60.0),
        ("Stress (MPa),60,Temperature (°C),850", 1123.15, 60.0),
    ],
)
def test_conditions_in_a_laboratory_s_words(read, entry: str, kelvin: float, stress: float):
    (history,) = read(f"{entry}\nTime (h),Strain (%)\n0,0\n1,0.5\n")
    assert history.temperature == pytest.approx(kelvin, rel=1e-12)
    assert history.loading.steps == ((0.0, pytest.approx(stress, rel=1e-15)),)


def test_titles_comments_blank_lines_and_footers(read):
    text = (
        "Creep test of Monday\n\n# temperature_C: 850\nStress (MPa);60\n\nTime (h);Strain (%)\n\n0;0\n# paused: no\n"
        "// a remark\n1,5;0,5;\n\n2,5;0,75\nEnd of the record\n"
    )
    (history,) = read(text)
    assert (history.times.tolist(), history.labels["line 1"]) == ([0.0, 5400.0, 9000.0], "Creep test of Monday")
    assert "line 14 is a remark (End of the record)" in history.labels["assumed"]


@pytest.mark.parametrize("name", ["True strain", "True creep strain", "Hencky strain", "wahre Dehnung", "eps_true"])
def test_what_a_name_of_a_column_states(read, name):
    (history,) = read(f"# T_C: 850\n# stress_MPa: 60\nTime (h),{name} (%)\n0,0\n1,0.5\n")
    assert history.strain_measure == "logarithmic"
    with pytest.raises(HistoryError, match="x.csv:3: strain_measure is 'engineering', but .*x.csv:4, column .True s"):
        read("# T_C: 850\n# stress_MPa: 60\n# strain_measure: engineering\nTime (h),True strain (%)\n0,0\n1,1\n")


WIDE = {
    "one column a test": "Stress (MPa);60;80\nTemperature (°C);850;860\nTime (h);A1 strain (%);A2 strain (%)\n"
    "0;0;0\n1;0,5;0,7\n2;0,9;\n3;;1,5\n",
    "names above": "Test;A1;A2\nStress (MPa);60;80\nTemperature (°C);850;860\nTime (h);Strain (%);Strain (%)\n"
    "0;0;0\n1;0,5;0,7\n2;0,9;\n3;;1,5\n",
    "names below": "Stress (MPa);60;80\nTemperature (°C);850;860\nTime (h);Strain (%);\n;A1;A2\n"
    "0;0;0\n1;0,5;0,7\n2;0,9;\n3;;1,5\n",
    "names alone": "# columns: strain_pct\nStress (MPa);60;80\nTemperature (°C);850;860\nTime (h);A1;A2\n"
    "0;0;0\n1;0,5;0,7\n2;0,9;\n3;;1,5\n",
    "pairs with keys in each": "A1;;A2;\nStress (MPa);60;Stress (MPa);80\nTemperature (°C);850;Temperature (°C);860\n"
    "Time (h);Strain (%);Time (h);Strain (%)\n0;0;0;0\n1;0,5;1;0,7\n2;0,9;3;1,5\n",
    "pairs with keys before": ";A1;;A2;\nStress (MPa);60;;80;\nTemperature (°C);850;;860;\n"
    ";Time (h);Strain (%);Time (h);Strain (%)\n;0;0;0;0\n;1;0,5;1;0,7\n;2;0,9;3;1,5\n",
    "pairs named in the columns": "Stress (MPa);60;;80\nTemperature (°C);850;;860\n"
    "Time A1 (h);Strain A1 (%);Time A2 (h);Strain A2 (%)\n0;0;0;0\n1;0,5;1;0,7\n2;0,9;3;1,5\n",
    "each with its furnace": "Stress (MPa);60;80;;\nTime (h);A1 strain (%);A2 strain (%);A1 T (°C);A2 T (°C)\n"
    "0;0;0;850;860\n1;0,5;0,7;850;860\n2;0,9;;850;860\n3;;1,5;850;860\n",
    "a column of tests": "Test;Time (h);Strain (%);Stress (MPa);Temperature (°C)\nA1;0;0;60;850\nA1;1;0,5;60;850\n"
    "A1;2;0,9;60;850\nA2;0;0;80;860\nA2;1;0,7;80;860\nA2;3;1,5;80;860\n",
}


@pytest.mark.parametrize("layout", WIDE)
def test_two_tests_side_by_side(read, layout: str):
    first, second = read(WIDE[layout])
    assert (first.name, second.name) == ("A1", "A2")
    assert (first.condition, second.condition) == ("850 °C, 60 MPa", "860 °C, 80 MPa")
    np.testing.assert_array_equal(first.times, [0.0, 3600.0, 7200.0])
    np.testing.assert_array_equal(second.times, [0.0, 3600.0, 10800.0])
    np.testing.assert_allclose(first.outputs["strain"], [0, 0.005, 0.009], rtol=1e-15)
    np.testing.assert_allclose(second.outputs["strain"], [0, 0.007, 0.015], rtol=1e-15)
    assert first.source.endswith("x.csv (A1)")


def test_tests_in_one_furnace_share_its_column(read):
    """Wherever it stands and whatever names the tests; it goes on where one of them has ended."""
    rows = "0;649;0;0\n1;651;0,5;0,7\n2;650;0,9;\n3;650;;1,5\n"
    moved = "".join(";".join([a, c, d, b]) + "\n" for a, b, c, d in (row.split(";") for row in rows.splitlines()))
    for names, body in (
        ("Specimen;;A1;A2\nStress (MPa);;60;80\nTime (h);Temperature (°C);Strain (%);Strain (%)\n", rows),
        ("Stress (MPa);;60;80\ntime_h;furnace_C;strain_A1_pct;strain_A2_pct\n", rows),
        ("Stress (MPa);60;80;\nTime (h);A1 creep (%);A2 creep (%);Furnace (°C)\n", moved),
        ("Time (h);Furnace (°C);Creep 60 MPa (%);Creep 80 MPa (%)\n", rows),
    ):
        tests = read(names + body)
        assert [one.loading.program().values.max() for one in tests] == [60.0, 80.0], names
        assert [one.times.tolist() for one in tests] == [[0.0, 3600.0, 7200.0], [0.0, 3600.0, 10800.0]], names
        assert all(one.mean_temperature == pytest.approx(923.15, abs=0.6) for one in tests), names
        assert "MPa" in names.split("\n")[-2] or [one.name for one in tests] == ["A1", "A2"], names


def test_one_value_for_all_tests_is_told(read):
    text = "Stress (MPa);60;80\nTemperature (°C);850;\nTime (h);A1 strain (%);A2 strain (%)\n0;0;0\n1;0,5;0,7\n"
    first, second = read(text)
    assert second.temperature == pytest.approx(1123.15)
    assert "Temperature (°C) in line 2 holds for all tests" in first.labels["assumed"]


def test_texts_in_columns_are_conditions_and_labels(read):
    text = "Test,Heat,Time (h),Strain (%),Stress (MPa),T_C,Rupture time (h)\n"
    rows = "a,X7,0,0,60,850,20\na,X7,1,0.5,60,850,20\nb,X8,0,0,60,850,30\nb,X8,2,0.5,60,850,30\n"
    first, second = read(text + rows)
    assert (first.labels["heat"], second.labels["heat"]) == ("X7", "X8")
    assert (first.rupture_time, second.rupture_time) == (72000.0, 108000.0)


HEAD = "# temperature_C: 850\n# stress_MPa: 60\n"


REFUSED = [
    (
        "time_h,strain\n0,0\n1,0.5\n",
        "x.csv:3: 'strain' has no unit, and values up to 0.5 may be fractions or per cent; name it strain_1 or",
    ),
    ("time_h,strain_pct,strain_sd\n0,0,1\n1,1,1\n", "x.csv:3: 'strain_sd' has no unit"),
    ("time_h;strain_pct\n0;0\n1,234;2,345\n", "x.csv: '1,234' may be 1.234 or 1234; write"),
    ("time_h;strain_pct\n0;0\n1,5;2.5\n1,5;2,5\n", "x.csv:5: 'strain_pct' is '2.5' with a point"),
    ("time_h,strain_1\n0,0%\n1,5%\n", "x.csv:3: 'strain_1' is not in per cent, but its cells are"),
    ("time_h,strain_pct\n0,0\n# stress_MPa: 70\n1,1\n", "x.csv:5: 'stress_MPa' stands below the"),
    ("time_h,strain_pct\n0,0\nMaximum,1\n1,1\n", "x.csv:5: 'time_h' is 'Maximum'; write a fini"),
    ("time_h,strain_pct\n0,0\n1,1\nnan,nan\n", "x.csv:6: 'time_h' is 'nan'; write a finite"),
    ("Time (h);A1;A2\n0;0;0\n1;1;1\n", "x.csv:3: the column 'A1' does not say what it"),
    ("Time (h),Strain 1 (%),Strain 2 (%)\n0,0,0\n1,1,1\n", "x.csv:3: several columns of one quan"),
    ("Time (h),Strain (%),Room temp (°C)\n0,0,2\n1,1,2\n", r'what does it hold\? .* = {"Room temp .* = "unused"}$'),
    ("Time (h),Plastic strain (%),Strain (%)\n0,0,0\n1,1,1\n", "x.csv:3: column 'Plastic strain .*is n"),
    (
        "Time (h);A1 strain (%);A1 strain (%)\n0;0;0\n1;1;1\n",
        "x.csv:3: two tests are called 'A1'; give each its own name",
    ),
    (
        "Time (h);A1 strain (%);A2 strain (%)\n0;0;0\n1;a lot;1\n",
        "x.csv:5, column 2: 'strain .%.' is 'a lot'; write a finite number",
    ),
    (
        "Time (h);A1 strain (%);A2 strain (%);\n0;0;0;\n1;1;1;5\n",
        "x.csv:5: '5' stands in a column without a name; name it or remove it",
    ),
    (
        "Time (h);A1 strain (%);A2 strain (%)\n0;0;0\n1;1\n",
        "x.csv:5: number of cells 2, of columns 3; write one cell a column, separated by semicolons, empty",
    ),
    ("Time (h);A1 strain (%);A2 strain (%)\n0;0;\n1;1;\n", "x.csv:3: test 'A2' has no rows below its names"),
    ("5;6\ntime_h;strain_pct\n0;0\n1;1\n", "x.csv:3: the number 5 stands above the names of the col"),
    ("Stress (MPa);70\ntime_h;strain_pct\n0;0\n1;1\n", "x.csv:3: 'stress_MPa' was already given"),
    ("# decimal: dot\ntime_h;strain_pct\n0;0\n1;1\n", "x.csv:3: decimal is 'dot'; allowed: point"),
    ("# stress (mPa): 3\ntime_h;strain_pct\n0;0\n1;1\n", "x.csv:3: .*mPa"),
]


def test_what_is_asked_for(read):
    for text, message in REFUSED:
        with pytest.raises(HistoryError, match=message) as caught:
            read(HEAD + text)
        assert "\n" not in str(caught.value)


def test_a_canonical_file_that_a_spreadsheet_saved(read):
    text = (
        '# temperature_C: 850;\n"# stress_steps: 0 s 60.5 MPa; 1 h 70 MPa";\n# label note: a, b;\ntime_h;strain_pct\n'
    )
    (history,) = read(text + "0;0\n2,5;0,5\n")
    assert (history.loading.steps, history.labels["note"]) == (((0.0, 60.5), (3600.0, 70.0)), "a, b")


def test_what_empty_cells_of_conditions_leave_unknown_is_said(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text(
        "test,stress_MPa,temperature_C,modulus_GPa,heat,time_h,strain_pct\n"
        "A,60,850,150,X7,0,0\nA,60,850,150,X7,1,0.1\nB,70,850,,,0,0\nB,70,850,,,1,0.1\n"
    )
    first, second = ck.read_histories(path)
    assert "cell" not in first.labels["assumed"]
    assert "modulus_GPa unknown (empty cell)" in second.labels["assumed"].split(", ")
    assert "heat" not in second.labels


def test_the_decimal_sign_may_be_stated(read):
    (history,) = read(HEAD + "# decimal: comma\ntime_h;strain_pct\n1,000;0\n1,234;2,345\n")
    assert history.times.tolist() == [3600.0, 1.234 * 3600.0]


def test_text_files_are_tables_where_they_name_a_time(tmp_path: Path):
    (tmp_path / "a.txt").write_text("Time (h)\tStrain (%)\n0\t0\n")
    (tmp_path / "readme.txt").write_text("Time and again, this was measured.\n")
    assert HISTORY_CSV.accepts(tmp_path / "a.txt")
    assert not HISTORY_CSV.accepts(tmp_path / "readme.txt")
