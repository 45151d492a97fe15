"""Options that identify and discover share: changes of laws, subsets of tests."""

import json
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.cli.command_options import given_value
from creepkit.cli.shared import selected
from creepkit.errors import FitError, HistoryError, LawError
from creepkit.inverse.candidate_laws import LawChanges
from creepkit.options import options_of
from helpers.command_line import creepkit, one_line


def change_laws(laws, fix, bound):
    given = {"fix": fix, "bounds": bound}
    texts = {one.name: given_value(one, given.get(one.name), FitError) for one in options_of(LawChanges)}
    return LawChanges(temperature="none").changed(texts).applied(laws, [])


NORTON, HARDENING = ck.law("norton"), ck.law("strain-hardening")


def test_parameters_are_fixed_and_bounded_where_a_law_has_them() -> None:
    norton, hardening = change_laws([NORTON, HARDENING], ["n=5", "m=-0.5"], ["A=1e-20:1e-10"])
    assert norton.names == ("A",)
    assert hardening.names == ("A",)
    assert [law.table["A"].bounds for law in (norton, hardening)] == [(1e-20, 1e-10)] * 2
    assert norton.fingerprint == NORTON.fix(n=5).fingerprint
    assert change_laws([NORTON], None, None) == [NORTON]


@pytest.mark.parametrize(
    ("fix", "bound", "message"),
    [
        (["nn=5"], None, "fix: no parameter of norton, strain-hardening is called 'nn'; did you mean 'n'"),
        (None, ["m_1=0:1"], "bounds: no parameter of norton, strain-hardening is called 'm_1'; "),
        (["n"], None, "--fix n is not known; write NAME=NUMBER, such as n=5"),
        (["n=inf"], None, "--fix n=inf is not known; write NAME=NUMBER, such as n=5"),
        (["n=5", "n=6"], None, "--fix n=5 n=6: n is given twice; keep one of them"),
        (None, ["n=5"], "--bound n=5 is not known; write NAME=LOW:HIGH, such as n=1:8"),
    ],
)
def test_a_wrong_change_of_a_law_is_one_sentence(fix: list[str] | None, bound: list[str] | None, message: str) -> None:
    with pytest.raises(FitError) as raised:
        change_laws([NORTON, HARDENING], fix, bound)
    assert message in str(raised.value)


def test_bounds_and_fixed_values_must_make_sense() -> None:
    with pytest.raises(LawError, match="bounds are reversed or empty"):
        change_laws([NORTON], None, ["n=8:1"])
    with pytest.raises(LawError, match="cannot fix n = 9; allowed are 1 to 8"):
        change_laws([NORTON], ["n=9"], ["n=1:8"])


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


def test_options_for_measured_tests_are_refused_with_identifications() -> None:
    assert "--only, --fix, --bound and --surrogate are for tests" in one_line(
        creepkit("discover", "fit.json", "--fix", "n=5")
    )
