"""Tables as a hand or a logger leaves them: Dutch, tongues that are not known, uncertainties, turned rows, clocks that
stop, tables beside one another, sheets of diagrams.
"""

import re

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.readers.ends_of_tests import end_said_by, kind_of_column
from creepkit.records import constant_stress
from helpers.workbooks import workbook

HEAD = "Temperature (C);600\nStress (MPa);120\n"
HOURS = np.array([0.0, 2, 5, 10, 20, 40, 80])
STRAINS = 1e-3 * (1.0 - np.exp(-HOURS / 10.0)) + 2e-5 * HOURS


@pytest.fixture
def read(tmp_path):
    def one(text, answers=""):
        (tmp_path / "x.csv").write_text(text, encoding="utf-8")
        (tmp_path / "tests.toml").write_text(answers, encoding="utf-8")
        return ck.read_histories(tmp_path / "x.csv")

    return one


def rows(times, strains=STRAINS, decimal="."):
    return "".join(f"{t};{100 * e:.5f}\n".replace(".", decimal) for t, e in zip(times, strains, strict=True))


def is_planted(test, temperature=873.15, stress=120.0):
    np.testing.assert_allclose(test.times / 3600, HOURS)
    np.testing.assert_allclose(test.outputs["strain"], STRAINS, atol=1e-7)
    assert (test.temperature, test.loading.steps[0][1]) == (temperature, stress)


# ---- Dutch -----------------------------------------------------------------------------------------------------------


SAID_IN_DUTCH = {
    "ruptured": "breuk;gebroken;bezweken na 1500 uur;proefstuk gebroken;gescheurd;breuk na 800 h",
    "stopped": "niet gebroken;geen breuk;nog niet gebroken;loopt nog;ongebroken;verwijderd voor breuk;uitloper",
    "interrupted": "proef gestopt;onderbroken;afgebroken;uitgebouwd na 5000 uur",
    "unclear": "breuk verwacht;bijna gebroken;breuk in de klem;thermokoppel gebroken;proef beëindigd;gebroken?",
}


def test_what_is_said_in_dutch_of_an_end():
    wrong = {
        text: end_said_by(text)
        for end, texts in SAID_IN_DUTCH.items()
        for text in texts.split(";")
        if end_said_by(text) != end
    }
    assert not wrong
    kinds = {"Gebroken": "ruptured", "Gestopt": "stopped", "Resultaat": "status", "Opmerking": "remark"}
    assert {name: kind_of_column(name) for name in kinds} == kinds
    assert kind_of_column("Tijd tot breuk (h)") == kind_of_column("Rek bij breuk (%)") == ""


def test_dutch_tables_are_read(read):
    is_planted(*read(f"Temperatuur: 600 °C\nSpanning: 120 MPa\nTijd (uur);Rek (%)\n{rows(HOURS, decimal=',')}"))
    head = "Materiaal;P91\nProeftemperatuur (°C);600\nAangelegde spanning (MPa);120\nMeetlengte (mm);50\n"
    (test,) = read(f"{head}Tijd (h);Verlenging (mm)\n{rows(HOURS, 0.5 * STRAINS, ',')}")
    is_planted(test)
    assert test.alloy == "P91"
    names = "Proef;Spanning (MPa);Temperatuur (°C);Minimale kruipsnelheid (1/h);Tijd tot breuk (h);Opmerking\n"
    tests = read(f"{names}A1;120;600;1,2e-5;1500;gebroken\nA2;90;600;2e-6;8000;niet gebroken\n")
    assert [one.minimum_rate * 3600 for one in tests] == pytest.approx([1.2e-5, 2e-6])
    assert [(one.rupture_time, one.unruptured) for one in tests] == [(1500 * 3600, False), (None, True)]
    with pytest.raises(HistoryError, match="'proef gestopt': did these tests break"):
        read(f"{names}A1;120;600;1,2e-5;1500;proef gestopt\nA2;90;600;2e-6;8000;breuk\n")


# ---- a tongue that is not known --------------------------------------------------------------------------------------


def answer_in(error):
    """The lines of tests.toml that an error proposes."""
    pattern, line = re.search(r"tests\.toml beside it: (\[.*?\]) (columns = \{.*?\})", str(error.value)).groups()
    return f"{pattern}\n{line}\n"


@pytest.mark.parametrize("names", ["Czas (h);Odkształcenie (%);Naprężenie (MPa)\n", "Aika;Venymä;Jännitys\nh;%;MPa\n"])
def test_heads_in_a_tongue_that_is_not_known_are_asked_about(read, names):
    body = rows(HOURS).replace("\n", ";120\n")
    with pytest.raises(HistoryError, match=r"no time among .* or say what they are; write into tests.toml") as error:
        read(f"# temperature_C: 600\n{names}{body}")
    is_planted(*read(f"# temperature_C: 600\n{names}{body}", answer_in(error)))


def test_a_table_of_ruptures_in_a_tongue_that_is_not_known(read):
    text = "Koe;Jännitys (MPa);Lämpötila (°C);Murtoaika (h)\nA1;120;600;1500\nA2;100;600;5200\nA3;140;600;610\n"
    with pytest.raises(HistoryError, match='"Murtoaika .h." = "rupture time .h."') as error:
        read(text)
    tests = read(text, answer_in(error))
    assert {one.name: one.rupture_time / 3600 for one in tests} == {"A1": 1500, "A2": 5200, "A3": 610}


# ---- uncertainties ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "head",
    [
        "Temperature (C);600 ± 2\nStress (MPa);120 ± 0,5\n",
        "Temperature;600 °C ± 2 °C\nStress;120 +/- 1 MPa\n",
        "Creep test at 600 ± 2 °C and 120 ± 1 MPa\n",
    ],
)
def test_values_with_their_uncertainty(read, head):
    is_planted(*read(f"{head}Time (h);Strain (%)\n{rows(HOURS)}"))


def test_uncertainties_in_tables_of_tests_and_of_readings(read):
    """Between commas the uncertainty ends where the cell does."""
    names = "Test,Stress (MPa),Temperature (°C),Minimum creep rate (1/h),Rupture time (h),grain size (um)\n"
    tests = read(f"{names}A1,120 ± 1,600±2,1.2e-5 ± 1e-6,1500 ± 10,50 ± 3\nA2,100 ± 1,600,4.1e-6±3e-7,5200,50 ± 3\n")
    assert [one.loading.steps[0][1] for one in tests] == [120.0, 100.0]
    assert [one.minimum_rate * 3600 for one in tests] == pytest.approx([1.2e-5, 4.1e-6])
    assert [one.rupture_time / 3600 for one in tests] == [1500, 5200]
    assert "uncertainties of 'Stress (MPa)' not used" in tests[0].labels["assumed"]
    assert tests[0].labels["grain size (um)"] == "50 ± 3"  # a condition keeps what conditions read
    is_planted(*read(HEAD + "Time (h);Strain (%)\n" + rows(HOURS).replace("\n", " ± 0.01\n")))


# ---- the order of rows, and clocks -----------------------------------------------------------------------------------


def test_rows_with_the_newest_first_are_turned_round(read):
    stamps = [
        str(np.datetime64("2024-03-01T00:00") + np.timedelta64(int(60 * h), "m")).replace("T", " ") for h in HOURS
    ]
    for names, times in (("Time (h)", HOURS), ("Date and time", stamps)):
        (test,) = read(f"{HEAD}{names};Strain (%)\n{rows(times[::-1], STRAINS[::-1])}")
        is_planted(test)
        assert "rows turned round as the newest stands first" in test.labels["assumed"]
    both = "".join(f"{name};{line}\n" for name in "AB" for line in rows(HOURS[::-1], STRAINS[::-1]).split())
    for test in read(f"{HEAD}Test;Time (h);Strain (%)\n{both}"):
        is_planted(test)
    last, *earlier = rows(HOURS[::-1], STRAINS[::-1]).split()
    (test,) = read(f"{HEAD}Time (h);Strain (%);Remark\n{last};broken\n" + "".join(f"{one};\n" for one in earlier))
    assert test.rupture_time == test.times[-1] == 80 * 3600


@pytest.mark.parametrize(("name", "pause"), [("Time (h:mm:ss)", 20.0), ("Time", 25.0)])
def test_a_clock_that_begins_anew_behind_a_pause_is_asked_about(read, name, pause):
    """Elapsed times of both parts, of which the second begins with the last reading of the first."""
    hours = np.array([0.0, 2, 5, 10, 20, 25, 40, 60.5])
    strains = 1e-4 * hours**0.5
    k = int(np.flatnonzero(hours == pause)[0])
    parts = (hours[: k + 1], strains[: k + 1]), (hours[k:] - pause, strains[k:])
    clocks = ([f"{int(h)}:{round(60 * (h % 1)):02d}:00" for h in times] for times, _ in parts)
    body = "".join(rows(times, own) for times, (_, own) in zip(clocks, parts, strict=True))
    with pytest.raises(HistoryError, match=r'its clock begins anew: .* parts = "joined"'):
        read(f"{HEAD}{name};Strain (%)\n{body}")
    (test,) = read(f"{HEAD}{name};Strain (%)\n{body}", '["x.csv"]\nparts = "joined"\n')
    np.testing.assert_allclose(test.times / 3600, hours)
    np.testing.assert_allclose(test.outputs["strain"], strains, atol=1e-7)


def test_midnight_is_no_pause(read):
    text = f"{HEAD}Time of day;Strain (%)\n22:00:00;0\n23:30:00;0.1\n00:30:00;0.2\n02:00:00;0.3\n"
    (test,) = read(text)
    np.testing.assert_allclose(test.times / 3600, [0, 1.5, 2.5, 4])


def of_a_day(hours):
    return [f"{int(h) % 24:02d}:{round(h % 1 * 60):02d}:00" for h in hours]


def with_times(name, times):
    hours = np.arange(len(times))
    return f"{HEAD}{name};Strain (%)\n" + "".join(f"{t};{0.02 * h:.3f}\n" for t, h in zip(times, hours, strict=True))


@pytest.mark.parametrize("name", ["Time", "Time (h:mm:ss)", "Elapsed time"])
def test_a_clock_of_24_h_that_keeps_its_pace_passes_midnight(read, name):
    """Readings every five hours for three days by a clock that shows no days."""
    hours = np.arange(0.0, 73.0, 5.0)
    (test,) = read(with_times(name, of_a_day(hours)))
    np.testing.assert_allclose(test.times / 3600, hours)
    assert "passes midnight 2 times" in test.labels["assumed"]


def test_a_clock_that_may_pass_midnight_or_begin_anew_is_asked_of(read):
    """From 23:48 to 0:00 after steps of five hours: a pause, or twelve minutes."""
    text = with_times("Time", of_a_day([0, 5, 10, 15, 20, 23.8, 24, 25, 29]))
    with pytest.raises(HistoryError, match="may be elapsed or of the day: does it begin anew there, or pass midnight"):
        read(text)
    (test,) = read(text, '["x.csv"]\ncolumns = {Time = "time_of_day"}\n')
    np.testing.assert_allclose(test.times / 3600, [0, 5, 10, 15, 20, 23.8, 24, 25, 29])
    (test,) = read(text, '["x.csv"]\ncolumns = {Time = "elapsed_time"}\nparts = "joined"\n')
    np.testing.assert_allclose(test.times / 3600, [0, 5, 10, 15, 20, 23.8, 24.8, 28.8])
    late = with_times("Time", of_a_day(np.arange(0.5, 40.0, 3.0)))  # elapsed since an earlier start, or of the day
    with pytest.raises(HistoryError, match="may be elapsed or of the day"):
        read(late)
    for answer, first in (("time_of_day", 0.0), ("elapsed_time", 0.5)):
        (test,) = read(late, f'["x.csv"]\ncolumns = {{Time = "{answer}"}}\n')
        np.testing.assert_allclose(test.times / 3600, first + np.arange(0.0, 39.5, 3.0))


@pytest.mark.parametrize("form", ["{d}.{h:02d}:{m:02d}:00", "{d} days, {h}:{m:02d}:00", "{d}d {h:02d}:{m:02d}:00"])
def test_days_before_hours(read, form):
    """As .NET, Python and loggers write an elapsed time."""
    hours = [24.0, 30, 47.5, 60, 90.25]
    (test,) = read(
        with_times("Elapsed", [form.format(d=int(h // 24), h=int(h % 24), m=round(h % 1 * 60)) for h in hours])
    )
    np.testing.assert_allclose(test.times / 3600, hours)


def test_hours_of_half_a_day(read):
    (test,) = read(with_times("Time of day", ["10:00:00 PM", "11:30:00 PM", "12:30:00 AM", "1:00:00 PM"]))
    np.testing.assert_allclose(test.times / 3600, [0, 1.5, 2.5, 15])


# ---- tables beside one another, and sheets of diagrams ---------------------------------------------------------------


RUPTURES = {(550, 200): 1500.0, (550, 180): 4200.0, (550, 160): 9000.0, (600, 120): 1200.0, (600, 100): 5000.0}


def ruptures(tests):
    return {
        (round(t.temperature - 273.15), t.loading.steps[0][1]): (t.rupture_time or t.times[-1]) / 3600 for t in tests
    }


def test_tables_of_ruptures_beside_one_another(read, tmp_path):
    names = "Stress (MPa);t_r (h)"
    body = "200;1500;;120;1200\n180;4200;;100;5000\n160;>9000;;;\n"
    for head in (
        f"550 °C;;;600 °C;\n{names};;{names}\n",
        f"Ruptures of heat B7;;;;\n550 °C;;;600 °C;\n{names};;{names}\n",
        "T = 550 °C;;;T = 600 °C;\nStress;t_r;;Stress;t_r\nMPa;h;;MPa;h\n",
    ):
        tests = read(head + body)
        assert ruptures(tests) == RUPTURES
        assert [one.unruptured for one in tests] == [False, False, True, False, False]
    both = "Stress (MPa);Temperature (°C);t_r (h)"
    assert (
        ruptures(read(f"{both};;{both}\n200;550;1500;;120;600;1200\n180;550;4200;;100;600;5000\n160;550;>9000;;;;\n"))
        == RUPTURES
    )
    cells = [[float(c) if c.isdigit() else c or None for c in line.split(";")] for line in body.split()]
    sheet = [["550 °C", None, None, "600 °C"], ["Stress (MPa)", "t_r (h)", None, "Stress (MPa)", "t_r (h)"], *cells]
    assert ruptures(ck.read_histories(workbook(tmp_path / "r.xlsx", {"R": sheet}))) == RUPTURES


def test_a_sheet_of_a_diagram_does_not_hinder_the_others(tmp_path):
    curve = [["Stress (MPa)", 120], ["Temperature (C)", 600], ["Time (h)", "Strain (%)"]]
    curve += [[float(t), float(100 * e)] for t, e in zip(HOURS, STRAINS, strict=True)]
    diagram = [["Time [h]", None, None], [None, "creep curves", None], [None, None, "Strain"]]
    (test,) = ck.read_histories(workbook(tmp_path / "d.xlsx", {"T1": curve, "plot": diagram, "chart": [["Time (h)"]]}))
    is_planted(test)
    assert "sheet 'plot' not read as it has no column of time above readings" in test.labels["assumed"]


def test_what_stands_in_brackets_behind_a_condition_is_a_note_or_what_was_held(tmp_path):
    head = "# stress: 180 MPa (true stress held)\n# temperature: 600 °C (three thermocouples)\n"
    (tmp_path / "a.csv").write_text(f"{head}time (h),strain (%)\n0,0\n10,0.1\n20,0.2\n", encoding="utf-8")
    (test,) = ck.read_histories(tmp_path)
    assert (test.loading, test.temperature) == (constant_stress(180.0, "stress"), 873.15)
    assert test.labels["temperature (note)"] == "three thermocouples"
