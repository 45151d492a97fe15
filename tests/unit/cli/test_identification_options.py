"""Options that identify and discover share: changes of laws, subsets of tests."""

import json
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.cli.command_options import given_value
from creepkit.cli.identified_folder import check_identified_folder, write_ranking
from creepkit.cli.shared import is_file_name, selected
from creepkit.errors import CreepkitError, FitError, HistoryError, LawError
from creepkit.inverse.candidate_laws import LawChanges
from creepkit.inverse.selection import rank
from creepkit.inverse.settings import IdentificationSettings, default_nuisances
from creepkit.options import options_of
from creepkit.records import Nuisance
from helpers.command_line import creepkit, one_line
from helpers.rupture_tests import BAR


def change_laws(laws, fix, bound):
    given = {"fix": fix, "bounds": bound}
    texts = {one.name: given_value(one, given.get(one.name)) for one in options_of(LawChanges)}
    return LawChanges(temperature="none").changed(texts).applied(laws, [])


NORTON, HARDENING = ck.law("norton"), ck.law("strain-hardening")


def test_parameters_are_fixed_and_bounded_where_a_law_has_them() -> None:
    norton, hardening = change_laws([NORTON, HARDENING], ["n=5", "m=-0.5"], ["A=1e-20:1e-10"])
    assert norton.names == ("A",)
    assert hardening.names == ("A",)
    assert [law.table["A"].bounds for law in (norton, hardening)] == [(1e-20, 1e-10)] * 2
    assert norton.fingerprint == NORTON.fix(n=5).fingerprint
    assert change_laws([NORTON], None, None) == [NORTON]


def test_only_takes_labels() -> None:
    times = np.array([1.0, 2.0])
    tests = [ck.History(name, times, {"strain": times}, ck.constant_stress(50), 1073.15) for name in ("a", "b", "c")]
    assert [h.name for h in selected(tests, {"name": ("a", "c"), "temperature": ("1073",)})] == ["a", "c"]
    assert selected(tests, None) == tests
    with pytest.raises(HistoryError, match="no test has name=d; there are a, b, c"):
        selected(tests, {"name": ("d",)})


def test_a_sum_by_name_is_the_sum_of_the_laws() -> None:
    assert ck.law("norton+strain-hardening").fingerprint == (NORTON + HARDENING).fingerprint
    assert ck.law("norton + strain-hardening").names == ("A_1", "n_1", "A_2", "n_2", "m")
    with pytest.raises(LawError, match=r"there is no law 'strain-hardning': did you mean 'strain-hardening'"):
        ck.law("norton+strain-hardning")
    with pytest.raises(LawError, match="there is no law ''"):
        ck.law("norton+")


def test_a_law_of_the_command_line_has_its_changes_in_its_files(tmp_path: Path) -> None:
    folder = ck.example_data("planted creep curves")
    words = ("--law", "norton+strain-hardening", "--fix", "n_1=5", "--fix", "Q=3.5e5", "--bound", "n_2=3:6")
    quick = ("--starts", "1", "--frames", "12", "--to", str(tmp_path), "--json")
    answer = json.loads(creepkit("identify", str(folder), *words, *quick).stdout)
    (law,) = answer["laws"]
    assert law["parameters"].keys() == {"A_1", "A_2", "n_2", "m"}
    assert 3 <= law["parameters"]["n_2"]["value"] <= 6


def test_weights_that_select_does_not_take_are_an_error() -> None:
    tests = ck.read_histories(ck.example_data("planted creep curves"))
    with pytest.raises(FitError, match="compares laws by their likelihood, found weights='equal'"):
        ck.select(["norton", "strain-hardening"], tests, weights="equal")
    for of_settings in (lambda s: ck.select(["norton"], tests, settings=s), lambda s: ck.ScreeningOptions(settings=s)):
        with pytest.raises(FitError, match="compares laws by their likelihood, found weights='equal'"):
            of_settings(ck.IdentificationSettings(weights="equal"))


def test_options_for_measured_tests_are_refused_with_identifications() -> None:
    assert "--only, --fix, --bound and --using are for tests" in one_line(
        creepkit("discover", "fit.json", "--fix", "n=5")
    )


def test_what_has_no_effect_with_or_without_a_plate_is_refused() -> None:
    alone = (["--dense", "none"], ["--workers", "1"], ["--compositions", "c.csv"])
    of_plate = (["--sums"], ["--penalty", "l2"], ["--further-tests"])
    cases = [(words, f"{words[0]} is for a plate: add --by alloy, or leave it out") for words in alone]
    cases += [(["--by=alloy", *words], f"{words[0]} is not for a plate, ") for words in of_plate]
    cases += [(["--budget-s", "5"], "--budget-s is for a search of laws: add --search")]
    cases += [(["--search", "--law", "norton"], "--law is not for a search of laws")]
    answers = [(one_line(creepkit("identify", "tests", *words)), sentence) for words, sentence in cases]
    assert [(answer, sentence) for answer, sentence in answers if sentence not in answer] == []


# ---- identify options ------------------------------------------------------------------------------------------------

# Options of `creepkit identify`, from text.


OPTIONS = {one.name: one for one in options_of(IdentificationSettings)}


def read(option, text):
    if option in OPTIONS:
        return given_value(OPTIONS[option], text)
    return change_laws([NORTON, HARDENING], *(text if option == one else None for one in ("fix", "bound")))


def test_words_and_numbers_by_name():
    assert read("weights", "equal") == "equal"
    assert read("usual_errors", "none") == "none"
    assert read("usual_errors", "temperature=3, load=0.01") == {"temperature": 3.0, "load": 0.01}


def test_nuisances_are_added_to_the_usual_two():
    assert read("nuisances", None) is None
    offset, rate = Nuisance("offset"), Nuisance("rate")
    thickness = Nuisance("thickness", mean=0.4935, sd=0.027)
    assert read("nuisances", ["thickness=0.4935:0.027"]) == default_nuisances(thickness) == (offset, rate, thickness)
    rough = Nuisance("rate", sd=0.2)
    assert read("nuisances", ["temperature", "rate=0:0.2"]) == (offset, Nuisance("temperature"), rough)
    assert read("nuisances", ["thickness=0.4935:0.027", "rate=none"]) == (offset, thickness)
    assert read("nuisances", ["rate=none", "offset=none"]) == ()


CANNOT_BE_READ = [
    ("fix", ["nn=5"], "fix: no parameter of norton, strain-hardening is called 'nn'; did you mean 'n'"),
    ("bound", ["m_1=0:1"], "bounds: no parameter of norton, strain-hardening is called 'm_1'; "),
    ("fix", ["n"], "--fix n is not known; write NAME=NUMBER, such as n=5"),
    ("fix", ["n=inf"], "--fix n=inf is not known; write NAME=NUMBER, such as n=5"),
    ("fix", ["n=5", "n=6"], "--fix n=5 n=6: n is given twice; keep one of them"),
    ("bound", ["n=5"], "--bound n=5 is not known; write NAME=LOW:HIGH, such as n=1:8"),
    ("nuisances", ["ofset=3"], "--nuisance ofset=3: nuisance 'ofset' is not known; did you mean 'offset'"),
    ("nuisances", ["thicknes=0.5"], "nuisance 'thicknes' is not known; did you mean 'thickness'"),
    ("nuisances", ["rat=none"], "--nuisance rat=none: 'rat' is no default nuisance that could be left out; did you"),
    ("nuisances", ["thickness=thin"], " is not known; write KIND"),
    ("nuisances", ["rate step=0:1"], "--nuisance rate step=0:1: nuisance 'rate step': start is 0 s; say when"),
    ("nuisances", ["temperature=nan"], " is not known; write KIND"),
]


def test_what_cannot_be_read_is_one_sentence():
    wrong = []
    for option, text, words in CANNOT_BE_READ:
        with pytest.raises(CreepkitError) as raised:
            read(option, text)
        wrong += [] if words in str(raised.value) else [(text, str(raised.value))]
    assert wrong == []


# ---- identified folder -----------------------------------------------------------------------------------------------

# The folder of `creepkit identify` holds one run: a later one replaces it.


@pytest.fixture(scope="module")
def rankings():
    times, rng = np.geomspace(3.6e3, 3.6e5, 12), np.random.default_rng(3)
    tests = [
        ck.History(
            f"bar {s:g}", times, {"strain": 1e-18 * s**5 * times + rng.normal(0.0, 2e-6, 12)},
            ck.constant_stress(s, "stress"), 1073.15,
        )
        for s in (80.0, 100.0, 120.0)
    ]  # fmt: skip
    how = {"using": BAR, "starts": 1, "nuisances": [ck.Nuisance("rate", sd=0.1)]}
    norton, hardening = (ck.identify(name, tests, **how) for name in ("norton", "strain-hardening"))
    return rank([norton], challenge=False), rank([hardening], challenge=False)


def _names(folder):
    return sorted(path.name for path in folder.iterdir() if not path.name.startswith("."))


def _run(ranking, folder):
    check_identified_folder(folder, [one.fit.law for one in ranking.laws])
    return write_ranking(ranking, folder)


def test_a_later_run_leaves_nothing_of_the_former_one_and_what_is_not_its(rankings, tmp_path):
    _run(rankings[0], tmp_path)
    (tmp_path / "notes.txt").write_text("mine")
    ck.export(rankings[0].best, "c", to=tmp_path / "norton.c")  # of creepkit, and of another command
    written = _run(rankings[1], tmp_path)
    assert _names(tmp_path) == sorted([*(path.name for path in written), "notes.txt", "norton.c"])
    assert [one.fit.law.name for one in ck.load(tmp_path / "ranking.json").laws] == ["strain-hardening"]


def test_a_changed_file_of_the_former_run_is_neither_removed_nor_mixed_with_another_run(rankings, tmp_path):
    _run(rankings[0], tmp_path)
    (tmp_path / "norton.tex").write_text("edited by hand")
    before = _names(tmp_path)
    with pytest.raises(FitError, match=r"norton\.tex: .*creepkit did not write it as it is now"):
        _run(rankings[1], tmp_path)
    assert _names(tmp_path) == before
    assert (tmp_path / "norton.tex").read_text() == "edited by hand"


# ---- law sources -----------------------------------------------------------------------------------------------------

# Laws as `simulate` and `export` name them: a registered law first, then a file that holds one with its values.


TEST = ("--stress", "100", "--end-h", "10", "--points", "5", "--temperature-c", "20")


def test_a_file_of_a_law_with_values_is_simulated_as_its_values_are(tmp_path):
    file = tmp_path / "valued.json"
    ck.export("norton", "json", {"A": 1e-16, "n": 4.0}, to=file)
    assert creepkit("simulate", str(file), *TEST, "--to", str(tmp_path / "own.csv")).exit_code == 0
    times = np.linspace(0.0, 36000.0, 5)
    creep = -np.log(1 - 4 * 1e-16 * 100.0**4 * times) / 4  # under constant load, true strain by Norton's law
    (own,) = ck.read_histories(tmp_path / "own.csv")
    assert np.allclose(own.outputs["strain"], creep, rtol=1e-4)
    changed = creepkit("simulate", str(file), "--set", "n=5", *TEST)
    named = creepkit("simulate", "norton", "--set", "A=1e-16", "--set", "n=5", *TEST)
    assert changed.exit_code == 0
    assert [line for line in changed.stdout.splitlines() if not line.startswith("#")] == [
        line for line in named.stdout.splitlines() if not line.startswith("#")
    ]


def test_names_of_laws_come_before_files_and_a_file_without_a_suffix_needs_its_path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "norton+strain-hardening").write_text("{}")
    named = {"norton": False, "norton+strain-hardening": False, "./norton": True, "fit.json": True, "unknown": False}
    assert {word: is_file_name(word) for word in named} == named
    for name in ("norton", "mine"):
        ck.export("norton", "json", {"A": 1e-16, "n": 4.0}, to=f"{name}.json")
        (tmp_path / f"{name}.json").rename(name)
    assert "'norton' needs a value for A, n" in one_line(creepkit("simulate", "norton", *TEST))
    assert creepkit("simulate", "./norton", *TEST).exit_code == 0
    for command in (("simulate", "mine", *TEST), ("export", "mine", "--to", "latex")):
        assert "for the file of that name write ./mine" in one_line(creepkit(*command))
