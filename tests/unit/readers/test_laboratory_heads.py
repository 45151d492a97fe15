"""Heads as laboratories write them: German words, titles above tables of conditions, values in merged heads."""

from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.quality import remark_flags
from creepkit.readers.questions import Question
from helpers.workbooks import workbook

GERMAN = """# Zeitstandversuch DIN EN ISO 204;;;;
# Prüfer: Müller;;;;
Prüfspannung (MPa);110,0;;;
Prüftemperatur (°C);620;;;
Charge;K7;;;

Datum;Zeit;Dehnung;Last;T1
;h;%;kN;°C
03.03.2024 08:00;0,00;0,0000;8,639;620,4
03.03.2024 21:19;13,33;0,0245;8,639;619,7
04.03.2024 14:51;30,85;0,0400;8,639;619,7

Versuch beendet, planmäßig;;;;
"""


def test_a_german_table(tmp_path: Path) -> None:
    file = tmp_path / "P1.csv"
    file.write_text(GERMAN, encoding="latin-1")
    (test,) = ck.read_histories(file, ignore=["Datum", "Last", "T1"])
    assert (test.loading.program().values.tolist(), test.temperature) == ([110.0], pytest.approx(893.15))
    np.testing.assert_allclose(test.times, [0, 13.33 * 3600, 30.85 * 3600])
    np.testing.assert_allclose(test.outputs["strain"], [0, 2.45e-4, 4e-4])
    assert (test.labels["heat"], test.labels["operator"], test.operator) == ("K7", "Müller", "")


def test_titles_above_conditions_and_remarks_beside_frames(tmp_path: Path) -> None:
    conditions = [["Program Z, 2024"], [], ["Test", "Stress (MPa)", "Temperature (°C)"], ["Z1", 120, 650]]
    frames = [["Test Z1"], ["Temperature", 650, "°C"], ["Time (h)", "Creep strain (%)", "Remark"]]
    frames += [[0, 0.0, "start"], [1, 0.01], [5, 0.02]]
    file = workbook(tmp_path / "program.xlsx", {"Summary": conditions, "Z1": frames})
    (test,) = ck.read_histories(file)
    assert (test.loading.program().values.tolist(), test.temperature) == ([120.0], 923.15)
    assert (test.times.size, test.labels["line 4"]) == (3, "start")


SHEETS = {"575°C": (140, 160), "600 °C": (110, 130)}


def sheet_by_temperature(title: str) -> list[list[object]]:
    """Titles, stresses above pairs of columns, names, units, and a note in the margin."""
    stresses = SHEETS[title]
    head = [[f"Creep tests, {title}, constant load, furnace 2"], ["d0 = 8 mm, L0 = 40 mm"], ["operator: day shift"], []]
    names = [["time", "strain", "time", "strain"], ["h", "%", "h", "%"]]
    rows: list[list[object]] = [[t, 1e-3 * t * stresses[0], t, 1e-3 * t * stresses[1]] for t in (0.1, 1.0, 2.0)]
    rows[1] += [None, "13.05. power failure 1 h"]
    return [*head, [f"{stresses[0]} MPa", None, f"{stresses[1]} MPa"], *names, *rows]


def test_a_sheet_that_is_called_a_temperature_below_100_states_it(tmp_path: Path) -> None:
    """A solder at 25 °C: without a title that says so, but no other words either."""
    path = workbook(tmp_path / "SAC305.xlsx", {"25 °C": sheet_by_temperature("575°C")[4:]})
    assert [test.condition for test in ck.read_histories(path)] == ["25 °C, 140 MPa", "25 °C, 160 MPa"]


def test_sheets_named_by_temperature(tmp_path: Path) -> None:
    """Twelve things that a laboratory writes about its columns, and none of them is a column."""
    from openpyxl import load_workbook
    from openpyxl.comments import Comment

    sheets = {title: sheet_by_temperature(title) for title in SHEETS}
    path = workbook(tmp_path / "creep.xlsx", {**sheets, "notes": [["heat 4711, normalised 1060 °C, tempered 770 °C"]]})
    book = load_workbook(path)
    book["575°C"]["C5"].comment = Comment("thermocouple 2 exchanged", "lab")
    book.save(path)
    tests = ck.read_histories(path)
    conditions = "575 °C, 140 MPa; 575 °C, 160 MPa; 600 °C, 110 MPa; 600 °C, 130 MPa"
    assert "; ".join(test.condition for test in tests) == conditions
    np.testing.assert_allclose(tests[3].outputs["strain"], 1.3e-3 * np.array([0.1, 1.0, 2.0]))
    labels = tests[1].labels
    assert "temperature 575 °C from sheet '575°C' row 1" in labels["assumed"]
    assert (labels["beside line 9"], labels["cell C5"]) == ("13.05. power failure 1 h", "thermocouple 2 exchanged")
    assert labels["sheet notes"] == "heat 4711, normalised 1060 °C, tempered 770 °C"
    assert labels["operator"] == "day shift"


FRAMES = "Time (h);Strain (%)\n0;0\n1;0,5\n"
WHERE_CONDITIONS_STAND = {
    "file name": ("RX_550C_120MPa.csv", FRAMES),
    "file name with blanks": ("P91 550 °C 120 MPa.csv", FRAMES),
    "title": ("x.csv", "Zeitstandversuch bei 550 °C und 120 N/mm²\n" + FRAMES),
    "assignments in a title": ("x.csv", "T = 550 °C; σ = 120 MPa\n" + FRAMES.replace(";", ",").replace("0,5", "0.5")),
    "title and file name": ("x_550C.csv", "Creep test, 823.15 K, 120 MPa\n" + FRAMES),
    "title and key": ("x_120MPa.csv", "# temperature_C: 551\nCreep at 550 °C\n" + FRAMES),
    "head of the columns": ("x.csv", "120 MPa;550 °C\n" + FRAMES),
}


@pytest.mark.parametrize("place", WHERE_CONDITIONS_STAND)
def test_conditions_wherever_they_stand(tmp_path: Path, place: str) -> None:
    name, text = WHERE_CONDITIONS_STAND[place]
    (tmp_path / name).write_text(text)
    (test,) = ck.read_histories(tmp_path / name)
    assert test.temperature == pytest.approx(824.15 if "key" in place else 823.15)
    assert test.loading.program().values.tolist() == [120.0]


CONTRADICTIONS = [
    ("x_550C.csv", "# temperature_C: 600\n# stress_MPa: 120\n", "states a temperature of 550 C, but "),
    ("x.csv", "# stress_MPa: 120\nCreep at 550 °C\nTemperature (°C);600\n", "x.csv:2: states a temperature of 550 °C"),
    ("x_130MPa.csv", "# temperature_C: 600\nCreep at 120 MPa\n", "a stress of 130 MPa, but .*x.csv:2 states 120"),
]
NOT_OF_THE_TEST = ("tempered at 770 °C", "E = 168 GPa", "Rp0.2 = 300 MPa", "110 to 180 MPa", "calibrated at 20 °C")


def test_sources_that_disagree_and_numbers_of_other_things(tmp_path: Path) -> None:
    for name, head, message in CONTRADICTIONS:
        (tmp_path / name).write_text(head + FRAMES)
        with pytest.raises(HistoryError, match=message.replace("x.csv", name)):
            ck.read_histories(tmp_path / name)
    for title in NOT_OF_THE_TEST:
        (tmp_path / "x.csv").write_text(f"# temperature_C: 600\n# stress_MPa: 120\n{title}\n{FRAMES}")
        (test,) = ck.read_histories(tmp_path / "x.csv")
        assert (test.condition, test.labels["line 3"]) == ("600 °C, 120 MPa", title)


BAR = "# temperature_C: 600\n# stress_MPa: 120\n"
DATES = "Tag;Uhrzeit;Dehnung (%)\n12.03.2021;9:25;0\n;15:25;0,05\n13.03.2021;9.25 Uhr;0,1\n"
SAID = {
    "SAC_75C": ("# stress_MPa: 12\ntime_h,strain_pct\n0,0\n9,0.1\n", 348.15, 9.0, "engineering"),
    "mil": (BAR + "# gauge_length_in: 2\nTime (h),Extension (mil)\n0,0\n9,2\n", 873.15, 9.0, "engineering"),
    "true": (BAR + "# Strain: DIC, true strain\nTime (h),Strain (%)\n0,0\n9,0.1\n", 873.15, 9.0, "logarithmic"),
    "clock": (BAR + DATES, 873.15, 24.0, "engineering"),
}
REMARKS = {
    "temp. raised from 600 to 620 C": 'temperature_steps = "0 s 873.15 K; 15 h 893.15 K"',
    "5 h cold, unloaded": 'stress_steps = "0 s 120 MPa; 10 h 0 MPa; 15 h 120 MPa"',
}


@pytest.mark.parametrize("name", SAID)
def test_what_heads_and_names_say(tmp_path: Path, name: str) -> None:
    (tmp_path / f"{name}.csv").write_text(SAID[name][0], "utf-8")
    (test,) = ck.read_histories(tmp_path)
    assert test.outputs["strain"][-1] == pytest.approx(1e-3)
    assert (test.temperature, test.times[-1] / 3600, test.strain_measure) == SAID[name][1:]


@pytest.mark.parametrize("remark", REMARKS)
def test_a_remark_on_a_change_or_a_pause_is_asked_for(tmp_path: Path, remark: str) -> None:
    rows = f"0,0,\n10,0.1,\n15,0.2,{remark}\n20,0.3,\n"
    (tmp_path / "a.csv").write_text(f"{BAR}Time (h),Strain (%),Remarks\n{rows}")
    with pytest.raises(Question) as caught:
        ck.read_histories(tmp_path)
    assert caught.value.entry(caught.value.choices[0]) == REMARKS[remark]
    (tmp_path / "tests.toml").write_text(f'["a.csv"]\n{REMARKS[remark]}\n')
    (test,) = ck.read_histories(tmp_path)
    levels = [p.at([36e3 + 1, 54e3 + 1]).tolist() for p in (test.temperature_program(), test.loading.program())]
    assert levels in ([[873.15, 893.15], [120, 120]], [[873.15, 873.15], [0, 120]])


HEADS_IN_ANY_ORDER = {
    "names, units, tests": ["Time;Strain;Strain", "h;%;%", ";B1;B2"],
    "names, tests, units": ["Time;Strain;Strain", ";B1;B2", "h;%;%"],
    "tests, names, units": [";B1;B2", "Time;Strain;Strain", "h;%;%"],
    "units above": ["h;%;%", "Time;Strain;Strain", ";B1;B2"],
    "stresses below": ["Time (h);Strain (%);Strain (%)", ";B1;B2", "Stress (MPa);120;140"],
    "stresses with units below": ["Time;Strain;Strain", "h;%;%", ";120 MPa;140 MPa", ";B1;B2"],
    "one name for both": ["Time (h);Strain (%);", ";B1;B2", ";120 MPa;140 MPa"],
    "heads of stress alone": ["Time (h);120 MPa;140 MPa", ";%;%", ";B1;B2"],
}


@pytest.mark.parametrize("order", HEADS_IN_ANY_ORDER)
def test_rows_of_a_head_in_any_order(tmp_path: Path, order: str) -> None:
    head = "\n".join(HEADS_IN_ANY_ORDER[order])
    stress = "" if "140" in head else "# stress_MPa: 120\n"
    (tmp_path / "x.csv").write_text(f"# temperature_C: 600\n{stress}{head}\n0;0;0\n1,5;0,021;0,024\n4;0,044;0,047\n")
    first, second = ck.read_histories(tmp_path / "x.csv")
    assert (second.times[1], second.outputs["strain"][1]) == (5400.0, pytest.approx(2.4e-4))
    assert (first.condition, second.condition) == ("600 °C, 120 MPa", f"600 °C, {120 if stress else 140} MPa")
    assert {first.name, second.name} in ({"B1", "B2"}, {"120 MPa", "140 MPa"})


def test_a_condition_of_a_group_of_columns(tmp_path: Path) -> None:
    """Of 600 °C, which stands once above two tests."""
    head = "Temperature (°C);600;;650;\nStress (MPa);120;140;100;110\nTime (h);A strain (%);B strain (%);C strain (%);"
    (tmp_path / "x.csv").write_text(f"{head}D strain (%)\n0;0;0;0;0\n1;0,1;0,2;0,3;0,4\n")
    tests = ck.read_histories(tmp_path / "x.csv")
    conditions = "600 °C, 120 MPa; 600 °C, 140 MPa; 650 °C, 100 MPa; 650 °C, 110 MPa"
    assert "; ".join(test.condition for test in tests) == conditions
    assert "Temperature (°C) in line 1 holds from '600' on" in tests[1].labels["assumed"]


NAMES_BEHIND_A_MARK = {
    "numpy.savetxt": ("# time_h,strain_pct\n", ","),
    "blanks": ("# time_h strain_pct\n", " "),
    "other delimiter than the rows": ("# Time (h), Strain (%)\n", " "),
    "tabs": ("#Time (h)\tStrain (%)\n", "\t"),
    "units in a row of their own": ("# time;strain\n# h;%\n", ";"),
    "below a remark": ("# digitised\n# figure 3 of the report\n# Time (h);Strain (%)\n", ";"),
}


@pytest.mark.parametrize("form", NAMES_BEHIND_A_MARK)
def test_names_behind_a_mark_of_comments(tmp_path: Path, form: str) -> None:
    names, delimiter = NAMES_BEHIND_A_MARK[form]
    rows = "".join(f"{t}{delimiter}{0.01 * t}\n" for t in (0.5, 2.25, 6.0))
    (tmp_path / "x.csv").write_text(f"# stress_MPa: 120\n# temperature_C: 600\n{names}{rows}")
    (test,) = ck.read_histories(tmp_path / "x.csv")
    np.testing.assert_allclose(test.times, [1800.0, 8100.0, 21600.0])
    np.testing.assert_allclose(test.outputs["strain"], [5e-5, 2.25e-4, 6e-4])


def test_numbers_that_nothing_names_are_asked_for(tmp_path: Path) -> None:
    """A reading is never taken for a name, and no advice would throw one away."""
    for text in ("# stress_MPa: 120\n0.5,0.02\n1,0.03\n", "# x, Curve1\n0.5,0.02\n1,0.03\n"):
        (tmp_path / "x.csv").write_text(text)
        with pytest.raises(HistoryError, match="time_h") as caught:
            ck.read_histories(tmp_path / "x.csv")
        assert "ignore" not in str(caught.value)


FILES_OF_LABORATORIES = {
    "German head": ("x.csv", "Versuch;Z1\nTemperatur;600;°C\nSpannung;120;MPa\n\nZeit;Dehnung\nStd.;%\n0;0\n10;0,1\n"),
    "French head": ("x.csv", "Température (°C);600\nContrainte (MPa);120\nTemps (h);Déformation (%)\n0;0\n10;0,1\n"),
    "US title": ("x.csv", "Temperature 1112 F, stress 17.404528 ksi\nTime, hr;Strain, in/in\n0;0\n10;0.001\n"),
    "tabs below a title": ("x.txt", "Creep test 12\n120 MPa, 600 °C\nTime (h)\tStrain (%)\n0\t0\n10\t0.1\n"),
    "symbols": ("x.csv", "T = 600 °C\nσ0 = 120 MPa\nt in h;ε in %\n0;0\n10;0,1\n"),
    "permille": ("x_600C.csv", "# stress_kg/mm2: 12.2365946\nt (1000 h);eps (mm/m)\n0;0\n0,01;1\n"),
    "rows of words": ("x_600C_120MPa.csv", "time [h];strain [%];note\n0;0;start\n10;0,1;door\n"),
    "a clock amid columns": ("x_120MPa.csv", "t (h);strain [%];clock;T (C)\n0;0;08:00;600\n10;0,1;18:00;600\n"),
    "a note in the margin": ("x_600C_120MPa.csv", "time [h];strain [%]\n0;0\n10;0,1;looks odd\n"),
    "two values in one head": (
        "x.csv",
        "A;;B;\n120 MPa / 873.15 K;;140 MPa 600 °C;\ntime/h;strain/%;time/h;strain/%\n0;0;0;0\n10;0,1;9;2\n",
    ),
    "names of curves": (
        "x.csv",
        "Temperature (°C);600;\nStress (MPa);120;140\nTime (h);e1 (%);e2 (%)\n0;0;0\n10;0,1;0,2\n",
    ),
    "groups": ("x.csv", "Stress (MPa);Temp (°C);Time (h);Strain (%)\n120;600;0;0\n;;10;0,1\n140;600;0;0\n;;10;0,3\n"),
    "groups by name": (
        "x.csv",
        "Sample;Stress (MPa);T_C;time_h;strain_pct\nA;120;600;0;0\n;;;10;0,1\nB;140;;0;0\n;;;10;0,3\n",
    ),
    "load on a bar": (
        "x.csv",
        "d0 = 8 mm\nL0 = 40 mm\nT = 600 °C\nF = 6.0318579 kN\nTime (h);Extension (mm)\n0;0\n10;0.04\n",
    ),
    "kilograms": ("x_600C.csv", "Diameter (mm);8\nTime (h);Load (kg);Strain (%)\n0;615.07834;0\n10;615.07834;0.1\n"),
}


@pytest.mark.parametrize("kind", FILES_OF_LABORATORIES)
def test_files_of_laboratories(tmp_path: Path, kind: str) -> None:
    """All hold a bar at 600 °C and 120 MPa that crept by 0.1 % in 10 h, the first of two in some."""
    name, text = FILES_OF_LABORATORIES[kind]
    (tmp_path / name).write_text(text, encoding="utf-8")
    test = ck.read_histories(tmp_path / name)[0]
    assert test.temperature_program().at(np.array([0.0]))[0] == pytest.approx(873.15)
    assert test.loading.program().at(np.array([0.0]))[0] == pytest.approx(120.0, rel=1e-6)
    assert (test.times[-1], test.outputs["strain"][-1]) == (pytest.approx(36000.0), pytest.approx(1e-3))


# ---- words of laboratories -------------------------------------------------------------------------------------------

# What laboratories write in tables: remarks that a test did not break, marks of missing values, German names.


TABLE = "test,stress_MPa,T (C),t_r (h),{name}\nA,200,800,1200,{a}\nB,220,800,800,{b}\n"
HEAD = "# specimen: uniaxial\n# stress_MPa: 100\n# temperature_C: 750\n# control: load\n"


def _read(tmp_path, text, name="t.csv"):
    (tmp_path / name).write_text(text, encoding="utf-8")
    return ck.read_histories([tmp_path / name])


@pytest.mark.parametrize("name", ["remark", "Bemerkung", "comment", "note"])
@pytest.mark.parametrize(
    "text", ["run-out", "Run out", "stopped; unbroken", "Läufer", "Durchläufer", "not ruptured", "nicht gebrochen",
             "did not break", "kein Bruch", "running", "censored at 800 h", "no failure yet"],
)  # fmt: skip
def test_a_remark_that_a_test_did_not_break_makes_no_rupture(tmp_path, name, text):
    first, second = _read(tmp_path, TABLE.format(name=name, a="", b=text))
    assert (first.unruptured, second.unruptured, second.rupture_time) == (False, True, None)
    assert "stopped before rupture by its remark" in second.labels["assumed"]
    both = "test,stress_MPa,T (C),t_r (h),remark,status\nA,200,800,1200,,stopped\nB,220,800,800,{},{}\n"
    stopped = _read(tmp_path, both.format(text, "stopped"))[1]
    assert (stopped.unruptured, stopped.rupture_time) == (True, None)
    ruptured = _read(tmp_path, both.format(text, "ruptured"))[1]
    assert (ruptured.unruptured, ruptured.rupture_time) == (False, 800 * 3600.0)


@pytest.mark.parametrize("mark", ["n.a.", "n/a", "NA", "n.b.", "-", "--", "k.A.", ""])
def test_marks_of_missing_values_are_empty_where_empty_is_allowed(tmp_path, mark):
    table = f"test,stress_MPa,T (C),min creep rate (1/h),t_r (h)\nA,200,800,1e-6,{mark}\nB,220,800,2e-6,800\n"
    first, second = _read(tmp_path, table)
    assert (first.rupture_time, second.rupture_time) == (None, 800 * 3600.0)
    beside = f"Time (h),A1 strain (%),B1 strain (%)\n1,0.1,0.2\n2,{mark},0.3\n3,0.3,0.4\n"
    head = HEAD + "# strain_measure: engineering\n# includes_elastic: no\n"
    assert [one.times.size for one in _read(tmp_path, head + beside)] == [2, 3]
    (alone,) = _read(tmp_path, head + f"time_h,strain_pct\n1,0.1\n2,{mark}\n3,0.3\n4,0.4\n")
    assert alone.outputs["strain"].tolist() == [0.001, 0.003, 0.004]
    assert "1 reading without a value of 'strain_pct' left out (line" in alone.labels["assumed"]


def test_german_names_and_units(tmp_path):
    german = (
        "# Anfangsdehnung_pct: 0.13\n# includes_loading: yes\n# strain_measure: engineering\n# control: load\n"
        "# specimen: uniaxial\nSpannung (kp/mm²);20\nTemperatur (°C);800\nZeit (h);plastische Dehnung ({unit})\n"
        "1;{a}\n10;{b}\n100;{c}\n"
    )
    (one,) = _read(tmp_path, german.format(unit="Mikrodehnung", a=2000, b=3000, c=4000))
    (other,) = _read(tmp_path, german.format(unit="%", a="0,2", b="0,3", c="0,4"))
    assert one.outputs["strain"] == pytest.approx(other.outputs["strain"], rel=1e-12)
    assert one.loading.program().values[-1] == pytest.approx(20 * 9.80665, rel=1e-12)
    assert not one.includes_elastic


def test_words_of_tables_are_words_of_heads_and_an_end_has_its_time(tmp_path):
    head = "Versuchsende;Bruch nach 388,4 h\nBruchdehnung (%);22\nHeat no;X7\nPrüftemperatur (°C);800\n"
    (test,) = _read(tmp_path, head + "Stress (MPa);260\nZeit (h);Dehnung (%)\n0;0\n100;0,5\n386,5;11\n")
    assert test.rupture_time == pytest.approx(388.4 * 3600)
    assert (test.labels["elongation_pct"], test.labels["heat"]) == ("22", "X7")
    with pytest.raises(HistoryError, match=r"'strain rate \(%/h\)' is a rate .*; is it a minimum creep"):
        _read(tmp_path, "stress (MPa),T (C),strain rate (%/h)\n80,550,6e-05\n100,550,2e-04\n")


# ---- tables of laboratories ------------------------------------------------------------------------------------------

# Tables with one row a test as laboratories write them: groups, heads, times to strains, marks of run-outs.


HOUR = 3600.0


def read(tmp_path, text, encoding="utf-8", name="t.csv"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return ck.read_histories(path)


def celsius(tests):
    return [round(float(one.temperature) - 273.15) for one in tests]


GROUPS = [
    (
        "Temp. (°C)\tStress (MPa)\ttr (h)\n600\t320\t4454\n\t260\t23220\n650\t320\t233\n\t260\t1112\n",
        [600, 600, 650, 650],
    ),
    ("T (C);Stress (MPa);tr (h)\n600;320;4454\n;260;23220\n;;\n650;320;233\n;260;1112\n", [600, 600, 650, 650]),
    ("Stress (MPa);tr (h);A (%)\n600 °C;;\n320;4454;21\n260;23220;21\n650 °C;;\n320;233;21\n", [600, 600, 650]),
    ("Creep rupture of X at 600 °C\n\nStress (MPa),tr (h)\n320,4454\n260,23220\n", [600, 600]),
    ("T (C);Stress (MPa);tr (h)\n600;320;4454\n″;260;23220\n650;320;233\n″;260;1112\n", [600, 600, 650, 650]),
    ("F,ksi,hr\nTemp,Stress,Rupture time\n1112,60,32190\n1202,45,312.9\n", [600, 650]),
    ("# Temp (F), Stress (ksi), Rupture time (hr)\n1112, 60, 32190\n1202, 45, 312.9\n", [600, 650]),
]


@pytest.mark.parametrize(("text", "temperatures"), GROUPS)
def test_temperatures_that_stand_once(tmp_path, text, temperatures):
    assert celsius(read(tmp_path, text)) == temperatures


def test_merged_cells_hold_for_their_rows(tmp_path):
    rows = [("T (C)", "Stress (MPa)", "tr (h)"), (600, 320, 4454), (None, 260, 23220), (650, 320, 233), (700, 260, 12)]
    path = workbook(tmp_path / "x.xlsx", {"r": rows}, lambda sheet: sheet.merge_cells("A2:A3"))
    tests = ck.read_histories(path)
    assert celsius(tests) == [600, 600, 650, 700]
    assert "temperature of the row above (empty cell)" in tests[1].labels["assumed"]


@pytest.mark.parametrize(
    "rows", ["600,320,44\n600,260,99\n,220,900\n", ",320,44\n600,260,99\n", "600,320,44\n600,,99\n"]
)
def test_a_lost_value_is_asked_for_with_its_cell(tmp_path, rows):
    with pytest.raises(Question, match=r"t\.csv:[234]: the cell of '.*' is empty; which (temperature|stress) is it\?"):
        read(tmp_path, f"T (C),Stress (MPa),tr (h)\n{rows}650,320,233\n650,300,433\n")


COLUMNS = [
    "t0.2% (h),t1% (h),tr (h)",
    "t(0.2%) h,t(1%) h,Life (hrs)",
    "Time to 0.2 % creep strain [h],Time to 1 % creep strain [h],Rupture time [h]",
    "Hours to 0.2%,Hours to 1%,Hours to rupture",
    "Zeit bis 0.2 % Dehnung (h),Zeit bis 1 % Dehnung (h),Bruchzeit (h)",
    "Temps à 0.2 % (h),Temps à 1 % (h),Temps à rupture (h)",
]


@pytest.mark.parametrize("names", COLUMNS)
def test_times_to_strains_are_frames(tmp_path, names):
    first, second = read(tmp_path, f"Temp (C),Stress (MPa),{names}\n550,200,120,1900,5200\n550,170,410,,>9000\n")
    assert first.outputs["strain"] == pytest.approx([0.002, 0.01])
    assert first.times == pytest.approx([120 * HOUR, 1900 * HOUR])
    assert (first.rupture_time, second.unruptured, second.times[-1]) == (5200 * HOUR, True, 9000 * HOUR)
    assert list(second.used) == [True, True, False]  # a creep strain of zero, 0.2 %, and the end


def test_times_that_are_no_times_to_strains_are_asked_for_or_refused(tmp_path):
    with pytest.raises(
        HistoryError, match=r"'t0.2 \(h\)' is a time that is not understood; is it a time to a strain\?"
    ):
        read(tmp_path, "T (C),Stress (MPa),t0.2 (h),tr (h)\n550,200,120,5200\n")
    with pytest.raises(HistoryError, match="the larger strain is reached first; correct one of them"):
        read(tmp_path, "T (C),Stress (MPa),t0.2% (h),t0.5% (h),tr (h)\n550,200,420,300,5200\n")


@pytest.mark.parametrize(
    ("mark", "hours"),
    [(">23220", 23220), ("≥23220", 23220), ("23220+", 23220), ("23220 →", 23220), ("> 23.220,5", 23220.5),
     ("23220 (run-out)", 23220), ("23220 läuft", 23220), ("plus de 23220", 23220), ("über 23220", 23220)],
)  # fmt: skip
def test_marks_of_run_outs(tmp_path, mark, hours):
    tests = read(tmp_path, f"T (C);Stress (MPa);tr (h)\n600;320;4454\n600;260;{mark}\n")
    assert (tests[1].unruptured, tests[1].times[-1]) == (True, pytest.approx(hours * HOUR))


@pytest.mark.parametrize("cell", ["23220*", "(23220)", "23220†", "23220 abgestellt"])
def test_marks_are_asked_about_unless_a_note_explains_them(tmp_path, cell):
    table = f"T (C);Stress (MPa);tr (h)\n600;320;4454\n600;260;{cell}\n"
    with pytest.raises(Question, match="did this test break then"):
        read(tmp_path, table)
    sign = cell.replace("23220", "").strip()
    assert read(tmp_path, f"{table}\n{sign} = run-out\n")[1].unruptured


def test_a_note_of_tests_that_run_is_asked_about(tmp_path):
    with pytest.raises(Question, match="the note 'The last test is still running' may speak of tests"):
        read(tmp_path, "T (C),Stress (MPa),tr (h)\n600,320,4454\n600,260,23220\n\nThe last test is still running\n")


def test_a_constant_rate_of_strain_is_recognised(tmp_path):
    """Strain in proportion to time with a stress that rises is imposed; negative ones are magnitudes of compression."""
    times = np.concatenate([np.arange(15) / 7, np.linspace(3, 70, 40)])
    stress = np.minimum(40e3 * 1e-2 * times, 112.0 * (1 + 0.01 * np.sin(40 * times)))
    for sign in (1, -1):
        rows = [f"{t:.2f};{sign * 1e-2 * t:.4f};{sign * s:.2f}" for t, s in zip(times, stress, strict=True)]
        head = "# temperature_C: 1000\n# strain_unit: 1\n# modulus_GPa: 40\ntime_s;True strain;stress_MPa\n"
        (tmp_path / "c.csv").write_text(head + "\n".join(rows))
        (one,) = ck.read_histories(tmp_path / "c.csv")
        assert (one.specimen, one.loading.quantity) == ("relaxation", "strain")
        np.testing.assert_allclose(one.loading.program().at(one.times), 1e-2 * times, atol=3e-3)
        np.testing.assert_allclose(one.outputs["stress"], stress, atol=0.01)
        assert "strain imposed (its rate is constant)" in one.labels["assumed"]
        assert ("magnitudes of negative stress and strain" in one.labels["assumed"]) == (sign < 0)
    creep = [f"{t:.2f};{1e-4 * t:.6f};{112.0 * (t > 0):.1f}" for t in times]
    (tmp_path / "c.csv").write_text(head + "\n".join(creep))
    assert ck.read_histories(tmp_path / "c.csv")[0].loading.quantity == "stress"


def test_remarks_of_tests_that_do_not_count(tmp_path):
    """Both with frames and without; pores and other voids are none."""
    excluded = ("voided joint (x-ray) - do not use", "void", "invalid test", "ungültig", "nicht verwenden", "à exclure")
    for remark in (*excluded, "void at the fracture surface", "failed in IMC", "used twice"):
        (tmp_path / "t.csv").write_text(
            f"test;T (C);stress_MPa;min rate (1/h);remarks\nA1;23;8;1e-6;\nA3;23;12;1e-5;{remark}\n"
        )
        tests = ck.read_histories(tmp_path / "t.csv")
        flags = list(remark_flags(tests))
        assert [flag.tests for flag in flags] == [("A3",)] * (remark in excluded), remark
        assert all('[[exclude]] test = "A3"' in str(flag) for flag in flags)
    framed = "# stress_MPa: 12\n# temperature_C: 600\n# label note: do not use\ntime_h;strain_pct\n0;0\n1;0.1\n2;0.15\n"
    (tmp_path / "f.csv").write_text(framed)
    assert [flag.kind for flag in ck.check_data_quality(ck.read_histories(tmp_path / "f.csv"))] == ["remark"]


BEAM = "specimen,four-point-bend\nWidth,4,mm\nHeight,3,mm\n{}\nLoad,72,N\nT (C),1300\n\nTime (h),deflection (mm)\n"


def test_the_spans_of_a_beam_are_read_by_their_usual_names_and_never_silently_by_default(tmp_path):
    path = tmp_path / "beam.csv"

    def read(*spans):
        path.write_text(BEAM.format("\n".join(f"{one},mm" for one in spans)) + "0,0\n1,0.001\n2,0.002\n")
        (test,) = ck.read_histories(path)
        return test

    for outer, inner in (("Piece span", "Inner span"), ("Support span", "Loading span"), ("Stützweite", "Lastabstand")):
        assert read(f"{outer},60", f"{inner},25").geometry == {"width": 4, "height": 3, "span": 60, "inner_span": 25}
    assert read("Outer span,60").labels["assumed"].endswith("lengths by default: inner_span 20 mm")
    with pytest.raises(HistoryError, match=r"'Major span' is a label, and no span .* span_mm = 60 \(or span_mm = 25\)"):
        read("Major span,60", "Minor span,25")


@pytest.mark.parametrize("name", ["Midspan deflection (mm)", "Durchbiegung Mitte (mm)", "Centre deflection (mm)"])
def test_where_the_deflection_of_a_beam_was_read_is_heard_or_said(tmp_path, name):
    """Read as that of the load points, a deflection in the middle made rates of creep half as high again."""
    text = BEAM.format("Outer span,60,mm\nInner span,25,mm") + "0,0\n1,0.001\n2,0.002\n"
    (tmp_path / "b.csv").write_text(text)
    (plain,) = ck.read_histories(tmp_path / "b.csv")
    assert "deflection of the load points (four-point-bend-midspan has the" in plain.labels["assumed"]
    (tmp_path / "b.csv").write_text(text.replace("deflection (mm)", name))
    with pytest.raises(HistoryError, match=r"is the deflection of the middle, and .*specimen: four-point-bend-midspan"):
        ck.read_histories(tmp_path / "b.csv")


def test_a_specimen_that_is_stated_stands_beside_the_mark_of_a_piece_and_a_modulus_is_asked_for(tmp_path):
    text = BEAM.format("Outer span,60,mm\nInner span,25,mm").replace("four-point-bend", "B1")
    (tmp_path / "beam.csv").write_text(text + "0,0\n1,0.001\n2,0.002\n")
    (tmp_path / "tests.toml").write_text('["*.csv"]\nspecimen = "four-point-bend-midspan"\n')
    (test,) = ck.read_histories(tmp_path / "beam.csv")
    assert (test.specimen, test.labels["specimen"]) == ("four-point-bend-midspan", "B1")
    assert [flag.kind for flag in ck.check_data_quality([test])] == ["modulus"]
    tube = test.replace(geometry={"outer_diameter": 9.5}, outputs={"diameter_growth": test.times / 3.6e5 + 9.51})
    assert [flag.kind for flag in ck.check_data_quality([tube])] == ["unit", "modulus"]


BOLT = "Diameter (mm);10\nT (°C);500\nStrain (%);0,15\nE-modulus (GPa);170\n\nTime (h);Load (kN)\n0;20,0\n10;12,5\n"


def test_bolts_under_a_held_strain_with_their_load_are_relaxation_by_their_cross_section(tmp_path):
    """20 kN on a bolt of 10 mm are 254.65 MPa; a column in kN is no stress, whatever an answer says."""
    _, one = (*read(tmp_path, BOLT, name="a.csv"), *read(tmp_path, BOLT, name="b.csv"))
    assert (one.specimen, one.elastic.E, one.loading.program().values[-1]) == ("relaxation", 170e3, 0.0015)
    np.testing.assert_allclose(one.outputs["stress"], np.array([20e3, 12.5e3]) / (25.0 * np.pi))
    (tmp_path / "tests.toml").write_text('["*.csv"]\ncolumns = {"Load (kN)" = "stress_MPa"}\n', encoding="utf-8")
    with pytest.raises(HistoryError, match=r"a.csv:6 \(and 1 more\): 'Load \(kN\)' is in kN and cannot be the stress"):
        ck.read_histories(tmp_path)


def test_a_dimple_is_read_by_the_symbols_of_its_pressures_and_the_plain_name_of_its_thickness(tmp_path):
    head = "Thickness (mm);0,48\nP1 (MPa);8\nP2 (MPa);10\nTj (h);4\nTemperature (°C);800\n\n"
    (one,) = read(tmp_path, f"{head}time (h);amplitude (mm)\n1;0,05\n3;0,08\n5;0,12\n")
    assert (one.specimen, one.geometry) == ("bulge", {"apex_thickness": 0.48})
    assert (one.loading.P1, one.loading.P2, one.loading.Tj) == pytest.approx((8.0, 10.0, 4 * 3600.0))


FOOTNOTES = """Creep rupture data, Grade 91 plate
Heat,Temp. (a),Stress (MPa),Min. creep rate (%/h),Time to rupture (h)
MGA,600,140,3.6 x 10^-3*,1203
MGB,600,120,7.2 x 10^-4,9020
MGB,650,60,1.8E-4,>20000 b)
* extensometer slipped at 3 %
(a) in °C
b) still running
"""


def test_footnotes_are_no_part_of_numbers_and_stand_with_the_tests(tmp_path):
    tests = read(tmp_path, FOOTNOTES, name="data.csv")
    assert [one.minimum_rate for one in tests] == pytest.approx([1e-8, 2e-9, 5e-10])
    assert [one.temperature for one in tests] == pytest.approx([873.15, 873.15, 923.15])
    assert [one.unruptured for one in tests] == [False, False, True]
    assert tests[0].labels["footnote *"] == "extensometer slipped at 3 % (of 3.6e-3)"


def test_a_power_of_ten_behind_the_stroke_of_a_quantity_and_a_heat_that_stands_once(tmp_path):
    """14.6 1/s was read of 14.6e-8: a quantity over its unit, as ISO 80000 heads columns."""
    text = "Reference code,T / °C,Stress / MPa,min. creep rate / {}\nMGA,1000,60,14.6\n,,80,44.2\n"
    for head, unit in (("10^-8 s^-1", 1e-8), ("10⁻⁸ s⁻¹", 1e-8), ("1e-6 h^-1", 1e-6 / 3600), ("%/10^3 h", 1e-5 / 3600)):
        tests = read(tmp_path, text.format(head), name="data.csv")
        assert [one.minimum_rate for one in tests] == pytest.approx([14.6 * unit, 44.2 * unit])
        assert [one.labels["heat"] for one in tests] == ["MGA", "MGA"]


def test_a_word_below_the_last_reading_of_a_curve_ends_it_alone(tmp_path):
    text = "C1: 130 MPa;;C2: 150 MPa;\nt (h);strain (%);t (h);strain (%)\n0;0;0;0\n10;1;5;1\n20;9;9;2\nrupture;;;\n"
    one, other = read(tmp_path, text, name="650C.csv")
    assert (one.rupture_time, other.rupture_time, other.unruptured) == (72000.0, None, False)
