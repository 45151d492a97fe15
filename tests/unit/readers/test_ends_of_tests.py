"""How a test ended, as laboratories write it in English, German and French: decided or asked for, never a rupture."""

import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.readers.ends_of_tests import end_said_by

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
