"""How a test ended, as laboratories write it in English, German and French: decided or asked for, never a rupture."""

import re
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from openpyxl import Workbook

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.readers.ends_of_tests import end_said_by
from creepkit.readers.questions import Question
from creepkit.records import History
from helpers.workbooks import workbook

SPELLINGS = [
    # column, cell of the test that did not break, cell of the tests that broke
    ("Censored", "1", "0"),
    ("Censored", "yes", "no"),
    ("censored?", "x", ""),
    ("Right-censored", "TRUE", "FALSE"),
    ("Run-out", "x", ""),
    ("Runout", "Y", "N"),
    ("Suspended", "1", "0"),
    ("Suspension", "S", "F"),
    ("Unbroken", "true", "false"),
    ("Survived", "yes", "no"),
    ("Broken", "no", "yes"),
    ("Broken?", "N", "Y"),
    ("Failed", "0", "1"),
    ("Failure", "no", "yes"),
    ("Fractured", "", "x"),
    ("Ruptured (y/n)", "n", "y"),
    ("Event", "0", "1"),
    ("Status", "run-out", "ruptured"),
    ("Status", "RO", "R"),
    ("Test status", "Discontinued", "Failed"),
    ("Status", "still running", "broken"),
    ("Status", "in progress", "failed"),
    ("Result", "not ruptured", "ruptured"),
    ("Result", "no failure", "failure"),
    ("Outcome", "Unfailed", "Failed"),
    ("Outcome", "removed before rupture", "rupture"),
    ("End of test", "interrupted", "fracture"),
    ("Remarks", "did not break", "broke in gauge length"),
    ("Remarks", "Test on-going", ""),
    ("Comments", "suspended at 23220 h, no failure", ""),
    ("Notes", "specimen still intact, not yet broken", "necking"),
    ("Esito", "non rotto", "rotto"),
    ("Rottura", "no", "sì"),
    ("Stato", "in corso", "rottura"),
    ("Osservazioni", "interrotta prima della rottura", "provino rotto"),
    ("Note", "senza rottura", "rottura nel tratto utile"),
    ("Resultado", "no rota", "rota"),
    ("Estado", "en curso", "rotura"),
    ("Observaciones", "suspendido sin rotura", "se rompió"),
    ("Observaciones", "la probeta aún no se ha roto", "probeta rota"),
    ("Zensiert", "ja", "nein"),
    ("Durchläufer", "x", ""),
    ("Gebrochen", "nein", "ja"),
    ("gebrochen", "N", "J"),
    ("Bruch", "0", "1"),
    ("Bruch (ja/nein)", "nein", "ja"),
    ("Status", "läuft noch", "gebrochen"),
    ("Status", "laeuft", "Bruch"),
    ("Prüfstatus", "Läufer", "Bruch"),
    ("Ergebnis", "ungebrochen", "gebrochen"),
    ("Ergebnis", "nicht gerissen", "gerissen"),
    ("Ende", "vor Bruch ausgebaut", "Bruch"),
    ("Versuchsende", "abgebrochen", "Probenbruch"),
    ("Bemerkung", "noch nicht gebrochen", ""),
    ("Bemerkungen", "Versuch läuft weiter", "Kriechbruch"),
    ("Anmerkung", "ohne Bruch beendet", "Bruch in der Messlänge"),
    ("Bem.", "Bruch nicht erreicht", ""),
    ("Rompu", "non", "oui"),
    ("Rompue", "0", "1"),
    ("Censuré", "oui", "non"),
    ("Rupture (oui/non)", "N", "O"),
    ("En cours", "x", ""),
    ("État", "en cours", "rompu"),
    ("Statut", "non rompu", "rompu"),
    ("Statut", "NR", "R"),
    ("Résultat", "suspendu", "rupture"),
    ("Fin d'essai", "arrêté", "rompue"),
    ("Remarques", "pas de rupture", ""),
    ("Observations", "essai toujours en cours", "striction"),
    ("Commentaire", "arrêt avant rupture", "rupture dans le congé"),
    ("Remarque", "éprouvette non cassée", "cassée"),
    ("Event", "censored", "failure"),
    ("Code", "runout", "fail"),
]
"""The truth was written down before the vocabulary."""

UNSEEN = [
    ("Status", "taken down on request"),
    ("Status", "2"),
    ("Result", "OK"),
    ("Outcome", "lever arm touched the floor"),
    ("State", "see lab book"),
    ("End of test", "project was out of money"),
    ("Remarks", "specimen still hangs in the furnace"),
    ("Remarks", "clock shows this much as of today"),
    ("Comments", "carried on in rig 7"),
    ("Bemerkung", "hängt noch"),
    ("Bemerkung", "Ofen ausgefallen"),
    ("Ende", "Stromausfall"),
    ("Anmerkung", "Stand 3. Mai"),
    ("Statut", "voir cahier"),
    ("Remarques", "la machine a lâché"),
]

SENTENCES = {
    "stopped": (
        *("Failure: no", "Bruch: nein", "Rupture: N/A", "Bruch: -", "n. gebr.", "o. Bruch", "failure-free"),
        *("1000 h without rupture", "n’a toujours pas cassé", "kein Versagen bis 5000 h", "failed to rupture"),
        *("Versagen noch nicht eingetreten", "aucune rupture constatée", "specimen was not broken when the test ended"),
        *(
            "failure did not occur",
            "nicht bis zum Bruch gefahren",
            "la rupture n'a pas été atteinte",
            "Bruch trat nicht ein",
        ),
    ),
    "unclear": (
        *("furnace failure at 3000 h", "before it could break", "no sign of failure", "broke during unloading"),
        *("failure criterion not met", "rupture lors du démontage", "test broken off", "Bruch steht noch aus"),
        *("failed in grips", "rupture expected in May", "ruptured?", "failed (grip slipped), not counted"),
        *(
            "failure of the load cell at 77 h",
            "Probe nach Versuchsende zerbrochen",
            "rupture du joint",
            "broken by hand",
        ),
        *("last reading before fracture", "Bruch des Gestänges"),
    ),
    "ruptured": (
        *("ruptured without necking", "Bruch ohne Einschnürung", "uncensored", "not interrupted, ran to rupture"),
        *("Bruch der Probe", "rupture de l'éprouvette", "broke near the fillet", "gerissen", "premature failure"),
    ),
    "": ("necking", "heat X7", "thermocouple replaced", "Probe hält noch", "creep of a disc 8 mm dia"),
}


HEAD = "Temp (C);Stress (MPa);Rupture time (h);"
ROWS = ((600, 320, "4454"), (600, 260, "23220"), (650, 320, "233.3"), (650, 260, "1112"))


def table(path, column, stopped, ruptured):
    """A table whose second test did not break."""
    cells = [stopped if time == "23220" else ruptured for _, _, time in ROWS]
    rows = [f"{t};{s};{time};{cell}" for (t, s, time), cell in zip(ROWS, cells, strict=True)]
    path.write_text("\n".join([HEAD + column, *rows]) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(("column", "stopped", "ruptured"), SPELLINGS)
def test_spellings_of_three_languages(tmp_path, column, stopped, ruptured):
    tests = ck.read_histories(table(tmp_path / "t.csv", column, stopped, ruptured))
    assert ([one.unruptured for one in tests], tests[1].times[-1]) == ([False, True, False, False], 23220 * 3600.0)
    assert [one.rupture_time is None for one in tests] == [False, True, False, False]


@pytest.mark.parametrize(("column", "text"), UNSEEN)
def test_what_is_not_understood_is_asked_for(tmp_path, column, text):
    with pytest.raises(HistoryError, match=r"tests\.toml") as caught:
        ck.read_histories(table(tmp_path / "t.csv", column, text, ""))
    assert f"'{text}'" in str(caught.value)


def test_what_sentences_say():
    found = {text: end_said_by(text) for texts in SENTENCES.values() for text in texts}
    assert found == {text: end for end, texts in SENTENCES.items() for text in texts}


@pytest.mark.parametrize(
    ("remark", "hours"),
    [
        ("Remark: ruptured after 453.1 h, A = 22 %", 453.1),
        ("Remark: gebrochen bei 20 h", None),
        ("specimen ruptured at 453.1 h, A = 22 %", 453.1),
        ("Bruch nach 453,1 h", 453.1),
        ("ruptured", 452.0),
        ("rupture elongation 22 % after 453.1 h", None),
        ("not ruptured", None),
    ],
)
def test_a_remark_above_a_curve_says_when_it_ruptured(tmp_path, remark, hours):
    head = f"# stress_MPa: 120\n# temperature_C: 600\n# {remark}\n"
    (tmp_path / "a.csv").write_text(f"{head}Time (h);Strain (%)\n0;0\n452;5\n")
    (test,) = ck.read_histories(tmp_path)
    assert test.rupture_time == (hours and pytest.approx(3600.0 * hours))


LAST_REMARKS = {
    "rupture": "ruptured",
    "gebrochen": "ruptured",
    "arrêt volontaire, non rompu": "stopped",
    "Versuch abgebrochen": "stopped",
    "test stopped": "stopped",
    "oil changed": "",
    "break?": "asked",
    "furnace failure": "asked",
}
"""{remark of the last frame: how the test ended}."""


@pytest.mark.parametrize("name", ["Observations", "Bemerkung", "Vermerk"])
def test_the_remark_of_the_last_frame_says_how_the_test_ended(tmp_path, name):
    """Remarks of earlier frames say nothing of it; `Vermerk` is no known name, and answered to be a label."""
    path, answers, wrong = tmp_path / "a.csv", tmp_path / "tests.toml", dict[str, str]()
    head = f"# stress_MPa: 120\n# temperature_C: 600\ntest;Time (h);Strain (%);{name}\n"
    other = "B;0;0;\nB;4;0.02;rupture of a fuse\nB;8;0.1;\n"
    for remark, end in LAST_REMARKS.items():
        label = f'["a.csv"]\ncolumns = {{{name} = "label"}}\n'
        answers.write_text(label)
        path.write_text(
            f"{head}A;0;0;\nA;5;0.05;test stopped, oil changed\nA;10;0.1;{remark}\n{other}", encoding="utf-8"
        )
        said = ""
        try:
            first, second = ck.read_histories(path)
        except Question as question:
            said = "asked"
            answers.write_text(label + question.entry(question.choices[1]))
            first, second = ck.read_histories(path)
            assert first.rupture_time == 36000.0
        else:
            said = "stopped" if first.unruptured else "ruptured" if first.rupture_time == 36000.0 else ""
        assert (second.unruptured, second.rupture_time) == (False, None)
        if said != end:
            wrong[remark] = said
    assert wrong == {}


def test_an_answer_about_the_end_acts_or_is_refused(tmp_path):
    path, answers = tmp_path / "a.csv", tmp_path / "tests.toml"
    head = "# stress_MPa: 120\n# temperature_C: 600\nTime (h);Strain (%);Note\n0;0;\n5;0.05;X1\n10;0.1;"
    path.write_text(f"{head}X7\n")
    answers.write_text('["*.csv"]\nended = {X7 = "ruptured"}\n')
    assert ck.read_histories(path)[0].rupture_time == 36000.0
    answers.write_text('["*.csv"]\nended = {X1 = "ruptured"}\n')
    (history,) = ck.read_histories(path)
    assert history.rupture_time is None
    assert "remark 'X1' of line 5 is not of the last frame" in history.labels["assumed"]
    answers.write_text('["*.csv"]\nended = {X8 = "ruptured"}\n')
    with pytest.raises(HistoryError, match="ended: 'X8' stands in no file"):
        ck.read_histories(path)
    (tmp_path / "b.csv").write_text(f"{head}x8\n")
    assert ck.read_histories(path)[0].rupture_time is None  # it is about another file


# ---- clock times -----------------------------------------------------------------------------------------------------

# Times of clocks: elapsed times are read, time stamps count from the first row, what may be either is asked for.


CLOCK_HEAD = "# stress_MPa: 60\n# temperature_C: 850\n"


def read(name: str, cells: list[str], path: Path, head: str = "") -> History:
    rows = "".join(f"{cell};0,{k + 1}12\n" for k, cell in enumerate(cells))
    path.write_text(f"{CLOCK_HEAD}{head}{name};Strain (%)\n{rows}", encoding="utf-8")
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
    ("Time", ["0:30:00", "2.5"], "", "'Time' is '2.5'; write h:mm:ss as above"),
    ("Time", ["0:30:00", "0:20:00"], "", "time falls from 1800 s to 1200 s"),
    ("time_s", ["0", "1"], "# date_order: day first\n", "x.csv:3: date_order says nothing here"),
    ("Time", ["0:30:00", "1:30:00"], "# date_order: mdy\n", "x.csv:3: date_order is 'mdy'; allowed: month first"),
    ("Time", ["1:30", "2:30"], "", "'Time' begins at 1:30, which may be elapsed or of the day"),
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


@pytest.mark.parametrize("remark", ["DNF", "n.b."])
def test_a_remark_of_one_row_is_asked_about_though_another_row_is_marked(tmp_path, remark):
    head = "Test;Temp (C);Stress (MPa);Life (h);Remarks\nA;600;200;1000;\n"
    (tmp_path / "a.csv").write_text(f"{head}B;600;150;5000;{remark}\nC;600;180;>2000;\n")
    with pytest.raises(HistoryError, match=f"'Remarks' says '{re.escape(remark)}': did these tests break"):
        ck.read_histories(tmp_path)
    (tmp_path / "tests.toml").write_text(f'["a.csv"]\nended = {{"{remark}" = "stopped"}}\n')
    assert [one.unruptured for one in ck.read_histories(tmp_path)] == [False, True, True]


def test_a_workbook_with_a_summary_of_merged_cells_a_row_of_units_and_a_note_below(tmp_path):
    book = Workbook()
    sheet = book.active
    sheet.title = "Summary"
    rows = [
        ("Programme IN-X, all tests",),
        (),
        ("Specimen", "Temp.", "Stress", "Rupture time", "Outcome"),
        ("", "°C", "MPa", "h"),
        ("K1", 650, 150, 20.0, "broken"),
        ("K2", None, 120, None, "discontinued after 30 h"),
        ("Q. A. 2021",),
    ]
    for row in rows:
        sheet.append(row)
    sheet.merge_cells("A1:E1")
    sheet.merge_cells("B5:B6")
    for name in ("K1", "K2"):
        sheet = book.create_sheet(name)
        head = [(f"Specimen {name}", None, None, None, "checked: MB"), (), ("t", "creep strain"), ("[h]", "[%]")]
        for row in [*head, (10, 0.1), (15, 0.2, None, None, "by hand"), (20 if name == "K1" else 30, 0.4)]:
            sheet.append(row)
        sheet.merge_cells("A1:C1")
    book.save(tmp_path / "b.xlsx")
    first, second = ck.read_histories(tmp_path)
    assert [(one.name, one.temperature, one.loading.steps) for one in (first, second)] == [
        ("K1", 923.15, ((0.0, 150.0),)),
        ("K2", 923.15, ((0.0, 120.0),)),
    ]
    assert (first.rupture_time, second.unruptured) == (72000.0, True)


def test_tables_drawn_with_bars_and_rates_with_a_dot_above(tmp_path):
    drawn = "# temperature_K: 873\n| t (h) | stress (kg/mm2) | creep, % | note |\n|---|---|---|---|\n"
    (tmp_path / "a.txt").write_text(drawn + "".join(f"| {h} | 12.24 | {0.01 * h:.3f} |  |\n" for h in range(1, 9)))
    (curve,) = ck.read_histories(tmp_path / "a.txt")
    assert curve.outputs["strain"][-1] == pytest.approx(8e-4)
    assert curve.loading.program().values[0] == pytest.approx(12.24 * 9.80665)
    dotted = "Run\tT/K\tσ/MPa\tε̇ss ×10^8 (s^-1)\nM1\t448\t40\t0.117\nM2\t448\t50\t0.312\n"
    (tmp_path / "b.txt").write_text(f"Table 2. Mg-Al\n{dotted}", "utf-8")
    rates = [one.minimum_rate for one in ck.read_histories(tmp_path / "b.txt")]
    assert rates == pytest.approx([1.17e-9, 3.12e-9])


@pytest.mark.parametrize("is_clock", [True, False])
def test_a_remark_amid_the_frames_is_a_note_and_a_title_of_another_test_is_none(tmp_path, is_clock):
    text = "# stress_MPa: 140\n# temperature_C: 650\nDatum;Uhrzeit;strain_%\n" if is_clock else "time_h;strain_%\n"
    text = text if is_clock else f"# stress_MPa: 140\n# temperature_C: 650\n{text}"
    rows = [f"0{1 + k}.03.2025;08:00:00;{0.1 * k:.1f}" if is_clock else f"{24 * k};{0.1 * k:.1f}" for k in range(6)]
    remark = "power failure, furnace cold - restart" + ";" * (1 + is_clock)
    (tmp_path / "a.csv").write_text(text + "\n".join([*rows[:4], remark, *rows[4:]]))
    (one,) = ck.read_histories(tmp_path / "a.csv")
    np.testing.assert_allclose(one.times, 86400.0 * np.arange(6))
    assert "line 8 is a remark (power failure" in one.labels["assumed"]
    (tmp_path / "a.csv").write_text(text + "\n".join([*rows, "another bar of the heat" + ";" * (1 + is_clock), *rows]))
    with pytest.raises(HistoryError):
        ck.read_histories(tmp_path / "a.csv")
