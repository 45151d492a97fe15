"""How a test ended, as laboratories write it in English, German and French: decided or asked for, never a rupture."""

import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.readers.ends_of_tests import end_said_by
from creepkit.readers.questions import Question

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
    ),
    "unclear": (
        *("furnace failure at 3000 h", "before it could break", "no sign of failure", "broke during unloading"),
        *("failure criterion not met", "rupture lors du démontage", "test broken off", "Bruch steht noch aus"),
        *("failed in grips", "rupture expected in May", "ruptured?"),
    ),
    "ruptured": ("ruptured without necking", "Bruch ohne Einschnürung", "uncensored", "gerissen", "premature failure"),
    "": ("necking", "heat X7", "thermocouple replaced", "Probe hält noch", "still holding"),
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
    assert [one.unruptured for one in tests] == [False, True, False, False]
    assert tests[1].times[-1] == 23220 * 3600.0
    assert [one.rupture_time is None for one in tests] == [False, True, False, False]


@pytest.mark.parametrize(("column", "text"), UNSEEN)
def test_what_is_not_understood_is_asked_for(tmp_path, column, text):
    with pytest.raises(HistoryError, match=r"tests\.toml") as caught:
        ck.read_histories(table(tmp_path / "t.csv", column, text, ""))
    assert f"'{text}'" in str(caught.value)


def test_what_sentences_say():
    found = {text: end_said_by(text) for texts in SENTENCES.values() for text in texts}
    assert found == {text: end for end, texts in SENTENCES.items() for text in texts}


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
