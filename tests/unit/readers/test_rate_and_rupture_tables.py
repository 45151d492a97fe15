"""Tables of tests, one row a test, and heads without frames: what they say, what they refuse, what reads back."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.readers.columns_of_tests import column_called
from creepkit.readers.history_csv import write_history
from creepkit.records import UNKNOWN_DURATION, History, constant_stress
from helpers.workbooks import workbook

TABLE = """# alloy: Alloy X
# control: stress
test,stress_MPa,Temperature (C),min creep rate [%/h],t_r (h),heat,grain size
A1,120,750,2.1e-4,8200,X7,40
A2,100,750,,>10000,X7,41
A3,150,750,1e-3,,X8,
"""


def read(tmp_path, text, name="table.csv", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return ck.read_histories(path)


def test_a_table_of_rates_and_rupture_times(tmp_path):
    first, second, third = read(tmp_path, TABLE)
    assert ([h.name for h in (first, second, third)], first.outputs) == (["A1", "A2", "A3"], {})
    assert first.minimum_rate == pytest.approx(2.1e-6 / 3600)
    assert first.rupture_time == first.times[-1] == 8200 * 3600
    assert (second.minimum_rate, second.rupture_time, second.unruptured) == (None, None, True)
    assert (second.times[-1], third.times[-1], third.end_known) == (1e4 * 3600, UNKNOWN_DURATION, False)
    assert (first.temperature, first.loading, first.alloy) == (1023.15, constant_stress(120.0, "stress"), "Alloy X")
    assert (first.labels["heat"], first.labels["grain size"]) == ("X7", "40")
    assert third.source.endswith("table.csv (A3)")


def test_the_same_in_another_dialect_and_without_names(tmp_path):
    text = "Stress / MPa;T (°C);Minimum creep rate (1/s);Time to rupture in h;End\n120,5;750;2,1e-9;8200;ruptured\n" \
           "100;750;1e-9;9000;running\n"  # fmt: skip
    first, second = read(tmp_path, text, encoding="latin-1")
    assert (first.name, first.loading.program().values[0]) == ("table 2", 120.5)
    assert (first.rupture_time, second.unruptured, second.times[-1]) == (8200 * 3600.0, True, 9000 * 3600.0)
    assert "control load" in first.labels["assumed"]


def test_a_sheet_of_a_spreadsheet(tmp_path):
    head = ("test", "stress_MPa", "T_C", "minimum_rate_1/h", "t_r (h)")
    rows = (head, ("A", 100, 700, 1e-6, 1000), ("B", 80, 700, None, ">5000"))
    first, second = ck.read_histories(workbook(tmp_path / "x.xlsx", {"rates": rows}))
    assert (first.minimum_rate, first.rupture_time) == (pytest.approx(1e-6 / 3600), 3.6e6)
    assert (second.unruptured, second.times[-1]) == (True, 1.8e7)


NAMES = [
    ("sigma (ksi)", ("stress", "ksi")),
    ("T_C", ("temperature", "C")),
    ("t (h)", ("end_time", "h")),
    ("MCR, h^-1", ("minimum_rate", "1/h")),
    ("steady-state creep rate (s-1)", ("minimum_rate", "1/s")),
    ("min rate per h", ("minimum_rate", "1/h")),
    ("minimum_rate_%/h", ("minimum_rate", "pct/h")),
    ("tr_h", ("rupture", "h")),
    ("elongation (%)", ("label elongation_pct", "")),
    ("Heat No", ("label heat", "")),
    ("strain rate (1/s)", ("", "")),
    ("Rupture time [10^3 h]", ("rupture", "kh")),
    ("min creep rate (%/1000h)", ("minimum_rate", "pct/kh")),
]


def test_names_of_columns():
    assert [(name, (one.quantity, one.unit)) for name, one in ((n, column_called(n)) for n, _ in NAMES)] == NAMES
    powers = {"Min. creep rate x 1E6 [1/h]": 1e-6, "MCR (1e-6 h-1)": 1e-6, "Minimum creep rate, 10-3 %/1000h": 1e-3}
    assert {name: column_called(name).factor for name in powers} == powers


REFUSED = [
    (("[%/h]", ""), r"table.csv:3: column 'min creep rate' has no unit; allowed: 1/s, 1/min, 1/h"),
    (("[%/h]", "[%]"), r"table.csv:3: column 'min creep rate \[%\]' has the unit 'pct', which is not understood"),
    (("2.1e-4", "0"), r"table.csv:4: 'min_?.*' is 0; a creep rate must lie above 0"),
    (("2.1e-4", "2.1x"), r"table.csv:4: .* is '2.1x'"),
    (("A2,", "A1,"), r"table.csv:5: test 'A1' already stands in .*table.csv:4; give each row its own name"),
    (("1e-3", ""), r"table.csv:6: no frames, no minimum creep rate and no end of the test"),
    ((">10000", "10000*"), r"table.csv:5: .* is '10000\*'"),
    (("heat", "stres_MPa"), r"table.csv:3: column 'stres_MPa' is not understood; did you mean 'stress'\?"),
    (("heat", "sigma_MPa"), r"table.csv:3: 'stress_MPa' and 'sigma_MPa' mean the same; keep one of them"),
    (("# control: stress", "# stress_MPa: 80"), r"table.csv:2: 'stress_MPa' is also a column"),
    (("grain size", "ended"), r"table.csv:4: 'ended' says '40' and '41': did these tests break, .*tests\.toml"),
    (("Temperature (C)", "note"), r"table.csv:4: no temperature"),
]


def test_bad_tables_are_refused_in_one_sentence(tmp_path):
    for (old, new), said in REFUSED:
        assert old in TABLE
        with pytest.raises(HistoryError, match=said) as caught:
            read(tmp_path, TABLE.replace(old, new))
        assert "\n" not in str(caught.value)


LONGER = [
    "rupture_h,heat\nA1,120,750,8200,5,X7\nA2,100,750,12500,X8",
    "rupture_h,heat,remark\nA1,120,750,8200,5,X7,broke\nA2,100,750,12500,X8,broke",
    "rupture_h\nA1,120,750,8200,5\nA2,100,750,12500",
]


def test_a_row_of_more_cells_than_names_in_a_table_with_commas_is_refused(tmp_path):
    """8200,5 h without quotes takes two cells, and had been read as 8200 h; commas of a last remark are its own."""
    for rows in LONGER:
        with pytest.raises(HistoryError, match=r"table.csv:2: number of cells \d, of columns \d; .* decimal comma"):
            read(tmp_path, f"test,stress_MPa,temperature_C,{rows}\n")
    text = "test,stress_MPa,temperature_C,rupture_h,remark\nA1,120,750,8200,broke, necked\nA2,100,750,9000,broke\n"
    assert read(tmp_path, text)[0].labels["remark"] == "broke, necked"


def test_commas_between_thousands(tmp_path):
    text = "test;stress (MPa);T (C);t_r (h)\nA;120.5;750;21,251\nB;140;750;>3,101\nC;160;750;911\n"
    assert [one.times[-1] / 3600 for one in read(tmp_path, text)] == [21251.0, 3101.0, 911.0]
    with pytest.raises(HistoryError, match=r"table.csv:2: '21,251' may be 21.251 or 21251; write into tests.toml"):
        read(tmp_path, text.replace(">3,101", "3101"))
    doubtful = text.replace("120.5", "120")
    with pytest.raises(
        HistoryError, match=r"may be 21.251 or 21251; .* decimal = \"comma\" \(or decimal = \"point\"\)"
    ):
        read(tmp_path, doubtful)
    for answer, hours in (("comma", 21.251), ("point", 21251.0)):
        (tmp_path / "tests.toml").write_text(f'["table.csv"]\ndecimal = "{answer}"\n')
        assert read(tmp_path, doubtful)[0].times[-1] == pytest.approx(3600 * hours)


ANOTHER = [
    *("Average creep rate (%/h)", "Tertiary creep rate (%/h)", "Kriechgeschwindigkeit bei Bruch (%/h)"),
    *("vitesse moyenne de fluage (1/h)", "Creep rate at 1000 h (1/h)", "Max. creep rate (1/h)", "Required life (h)"),
    *("Predicted rupture time (h)", "Mindeststandzeit (h)", "temps à rupture calculé (h)", "Predicted time to 1 % (h)"),
]


@pytest.mark.parametrize("name", ANOTHER)
def test_a_rate_that_is_not_the_smallest_and_a_time_that_was_not_measured_are_labels(tmp_path, name):
    tests = read(tmp_path, f"test;stress (MPa);T (C);{name};t_r (h)\nA;140;550;0.5;800\nB;120;550;0.25;2900\n")
    assert [(one.minimum_rate, one.rupture_time, one.labels[name]) for one in tests] == [
        (None, 800 * 3600.0, "0.5"),
        (None, 2900 * 3600.0, "0.25"),
    ]
    with pytest.raises(HistoryError, match=r"no minimum creep rate and no end of the test \(kept as labels: "):
        read(tmp_path, f"test;stress (MPa);T (C);{name}\nA;140;550;0.5\nB;120;550;0.25\n")


@pytest.mark.parametrize(("name", "said"), [("Creep rate (1/h)", True), ("Steady creep rate (1/h)", False)])
def test_a_rate_of_which_nothing_says_that_it_is_the_smallest_is_said_to_be(tmp_path, name, said):
    first, _ = read(tmp_path, f"test;stress (MPa);T (C);{name}\nA;140;550;1e-5\nB;120;550;1e-6\n")
    assert first.minimum_rate == pytest.approx(1e-5 / 3600)
    assert ("is the minimum creep rate" in first.labels["assumed"]) is said


@pytest.mark.parametrize("rows", ["Mean;140;550;950\nStd. dev.;0;0;212", "Mittelwert;;;950", "Écart-type;0;0;212"])
def test_rows_of_statistics_are_no_tests(tmp_path, rows):
    tests = read(tmp_path, f"test;stress (MPa);T (C);t_r (h)\nA;140;550;800\nN;140;550;1100\n{rows}\n")
    assert [one.name for one in tests] == ["A", "N"]
    assert f"rows of {rows.partition(';')[0]}" in tests[0].labels["assumed"]


def test_ends_that_contradict_one_another(tmp_path):
    head = "stress_MPa,temperature_C,t_r_h,ended\n"
    for end, said in (
        (">900,ruptured", "'>900' is a time without rupture, and the test ruptured; keep one"),
        (",ruptured", "the test ruptured, and nothing says when; write rupture_h"),
        (",stopped", "the test was stopped, and nothing says when; write end_time_h"),
    ):
        with pytest.raises(HistoryError, match=said):
            read(tmp_path, f"{head}100,700,{end}\n")
    (known,) = read(tmp_path, "stress_MPa,temperature_C,min rate (1/h),t_r_h,ended\n100,700,1e-6,,ruptured\n")
    assert (known.end_known, known.labels["ended"]) == (False, "ruptured")


# ---- heads without frames -----------------------------------------------------------------------------------------


def test_a_head_without_frames(tmp_path):
    text = "# temperature_C: 700\n# stress_MPa: 100\n# minimum_rate_%/h: 1e-4\n# minimum_rate_sd_1/h: 1e-7\n"
    (found,) = read(tmp_path, text)
    assert (found.minimum_rate, found.minimum_rate_sd) == (pytest.approx(1e-6 / 3600), pytest.approx(1e-7 / 3600))
    (stopped,) = read(tmp_path, text + "# ended: stopped\n# end_time_h: 500\n")
    assert (stopped.unruptured, stopped.times[-1]) == (True, 1.8e6)
    with pytest.raises(HistoryError, match="holds a header but no table"):
        read(tmp_path, "# temperature_C: 700\n# stress_MPa: 100\n")
    with pytest.raises(HistoryError, match=r"'minimum_rate_sd_1/h' stands there without a minimum_rate; give both"):
        read(tmp_path, text.replace("# minimum_rate_%/h: 1e-4\n", "# rupture_h: 5\n"))


EMPTY = [
    ("A,120,750,,900,", ["minimum_rate unknown (empty cell)", "ended ruptured (empty cell)"]),
    ("A,120,750,2e-6,,", ["rupture unknown (empty cell)", "ended unknown (empty cell)"]),
    ("A,120,750,2e-6,>900,", []),
    ("A,120,750,,>900,stopped", ["minimum_rate unknown (empty cell)"]),
    ("A,120,750,2e-6,900,ruptured", []),
]


def test_what_an_empty_cell_leaves_unknown_is_said(tmp_path):
    for row, unknown in EMPTY:
        (history,) = read(tmp_path, f"test,stress_MPa,temperature_C,min creep rate (1/h),t_r (h),ended\n{row}\n")
        assumed = history.labels["assumed"].split(", ")
        assert [text for text in assumed if "cell" in text] == unknown, row


def test_a_column_of_specimens_names_the_tests(tmp_path):
    path = tmp_path / "raten.csv"
    path.write_text("Specimen;Spannung [MPa];Temperatur [°C];minimale Kriechgeschwindigkeit [1/h]\nP1;100;700;1E-6\n"
                    "P2;120;700;2E-6\n", encoding="utf-8")  # fmt: skip
    assert [h.name for h in ck.read_histories(path)] == ["P1", "P2"]


@pytest.mark.parametrize(
    "known",
    [
        {"times": [1.0], "minimum_rate": 1.25e-9},
        {"times": [3e6], "minimum_rate": 1.25e-9, "minimum_rate_sd": 3e-11},
        {"times": [3e6], "rupture_time": 3e6},
        {"times": [3e6], "unruptured": True, "minimum_rate": 2e-9},
    ],
)
def test_a_test_without_frames_reads_back(tmp_path, known):
    times = np.array(known.pop("times"))
    test = History("A1", times, {}, constant_stress(80.0), 1000.0, labels={"heat": "X7"}, **known)
    (back,) = ck.read_histories(write_history(test, tmp_path / "A1.csv"))
    for name in ("name", "minimum_rate", "minimum_rate_sd", "rupture_time", "unruptured", "loading", "temperature"):
        assert getattr(back, name) == getattr(test, name)
    np.testing.assert_array_equal(back.times, test.times)
    assert back.labels["heat"] == "X7"


def test_a_rate_beside_frames_reads_back(tmp_path):
    test = History("A1", np.array([1.0, 2.0]), {"strain": [0.0, 0.1]}, constant_stress(80.0), 1000.0, minimum_rate=2e-9)
    assert ck.read_histories(write_history(test, tmp_path / "A1.csv"))[0].minimum_rate == 2e-9


def test_a_matrix_of_rupture_times_is_one_test_a_cell(tmp_path):
    """Temperatures by stresses as data sheets print them, in two languages, and in sheets of two heats."""
    expected = [(550, 235, 20.3, None), (550, 196, 132.3, None), (550, 177, None, 6e4), (600, 196, None, 11.9)]
    for head in (
        "Creep rupture data, heat B7 (h);;;\nTemperature (C);235 MPa;196 MPa;177 MPa",
        "Bruchzeit in h, Charge B7;;;\nTemperatur [°C];Spannung [MPa];;\n;235;196;177",
    ):
        tests = read(tmp_path, f"{head}\n550;20.3;132.3;(60000)\n600;-;>11.9;-\n")
        for test, (celsius, stress, broke, lasted) in zip(tests, expected, strict=True):
            assert (test.temperature - 273.15, test.loading.steps[0][1]) == pytest.approx((celsius, stress)), head
            assert test.times[-1] / 3600.0 == pytest.approx(broke or lasted), head
            assert (test.unruptured, test.labels["heat"]) == (broke is None, "B7"), head
    head = [["Test temp. (°C)", "Time to rupture (h) at stress (MPa) of"], [None, 235, 196], [550, 20.3, "(60000)"]]
    sheets = {f"Heat {heat}": [[f"Creep rupture data, Heat {heat}"], *head] for heat in ("AAA", "AAB")}
    tests = ck.read_histories(workbook(tmp_path / "matrix.xlsx", sheets))
    assert [(one.labels["heat"], one.unruptured) for one in tests[1:3]] == [("AAA", True), ("AAB", False)]
