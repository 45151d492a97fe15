"""Alloy after alloy: what is found, what is kept, what is done again, and what is said when something is wrong."""

import csv
import dataclasses

import numpy as np
import pytest

import creepkit as ck
from creepkit.api.objects import specimen
from creepkit.errors import FitError
from creepkit.inverse.composite_predictor import CompositePredictor
from creepkit.inverse.defect_correction import NumericalError
from creepkit.inverse.reference_conditions import detect_creep
from creepkit.inverse.settings import IdentificationSettings
from creepkit.readers.history_csv import write_history
from creepkit.records import PressureJump
from creepkit.screening.alloys import Alloy, Compositions, atomic_percent, check_tests, limitations, read_compositions
from creepkit.screening.results import confirmation_text, read_result, write_result
from creepkit.screening.screen import ScreeningOptions, screen
from helpers.narrow_predictor import Narrow
from helpers.planted_alloys import NORTON, Deadly, bars, bulge

QUICK = IdentificationSettings(starts=2, sobol_points=16)
COMPOSITIONS = Compositions({"X": {"Fe": 70.0, "Cr": 30.0}, "Y": {"Ni": 40.0, "Co": 38.0, "Cr": 22.0}})
TWO = [*bars("X"), *bars("Y", values={"A": 4e-14, "n": 3.5}, seed=2)]


def screened(histories, **how):
    how = {"laws": ["norton"], "dense": None, "workers": 1, "settings": QUICK, **how}
    options = ScreeningOptions(
        **{f.name: how.pop(f.name) for f in dataclasses.fields(ScreeningOptions) if f.name in how}
    )
    return screen(histories, options=options, **how)


@pytest.fixture(scope="module")
def plate():
    return screened(TWO, laws=["norton", "strain-hardening"], dense="strain-hardening", compositions=COMPOSITIONS)


def test_planted_values_lie_in_their_intervals(plate):
    """Norton's law of each alloy is planted; its exponent is known to some .01 from three stresses."""
    for alloy, n in (("X", NORTON["n"]), ("Y", 3.5)):
        told = {e.name: e for e in plate[alloy].best.estimates}
        assert plate[alloy].best.law.name == "norton"
        assert told["n"].value == pytest.approx(n, abs=0.05)
        assert told["n"].low - 0.02 < n < told["n"].high + 0.02


def test_shares_of_laws_go_by_class_and_add_up_to_one(plate):
    assert list(plate.by_class()) == ["Fe-rich", "near-equimolar"]
    assert [sum(share.values()) for share in plate.law_fractions().values()] == pytest.approx([1.0, 1.0])
    assert plate.law_fractions()["Fe-rich"]["norton"] == pytest.approx(plate["X"].laws[0].weight)


def test_a_law_that_a_more_exact_simulation_goes_on_moving_is_not_confirmed(plate):
    assert {confirmation_text(one) for one in plate.results} == {""}  # of bars nothing is more exact
    for settled, word in ((True, "yes"), (False, "no")):
        error = NumericalError("dimple", "bulge", {"strain": 1e-5}, 0.5, 0.2, settled=settled)
        fit = dataclasses.replace(plate["X"].best, numerical_error=error)
        corrected = dataclasses.replace(plate["X"], laws=(dataclasses.replace(plate["X"].laws[0], fit=fit),))
        assert confirmation_text(corrected) == word
        text = str(dataclasses.replace(plate, results=(corrected,)))
        assert ("X: not confirmed: at the optimum dimple differs from bulge" in text) is not settled


# ---- kept, and done again ------------------------------------------------------------------------------------------


def test_laws_outside_the_class_of_a_surrogate_are_the_specimens_own():
    """Values and the place of the law among the others are those of the bars; a note says by what."""
    narrow, itself = (screened(TWO[:3], using=using)["X"] for using in (Narrow(), specimen("uniaxial")))
    assert narrow.best.law.name == "norton"
    assert narrow.best.values == itself.best.values
    assert "identified with 'uniaxial' in the place of 'narrow': law 'norton' is none of its laws" in narrow.notes


def test_an_answer_is_read_back_as_it_was(plate, tmp_path):
    answer = plate["X"]
    found = read_result(write_result(answer, tmp_path / "X.json"))
    for field in ("alloy", "verdict", "notes", "failed_laws", "equivalents", "cpu_seconds"):
        assert getattr(found, field) == getattr(answer, field)
    assert found.best.values == answer.best.values


def test_interrupted_it_goes_on_where_it_was(tmp_path):
    def stop(task, done, total, note):
        assert (task, done, total) == ("alloys", 1, 2)
        assert note.startswith("X done, ")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        screened(TWO, to=tmp_path, progress=stop)
    kept = (tmp_path / "X.json").read_bytes()
    seen = []
    found = screened(TWO, to=tmp_path, progress=lambda *told: seen.append(told[1:3]))
    assert seen == [(2, 2)]
    assert (tmp_path / "X.json").read_bytes() == kept
    assert [a.best.law.name for a in found.results] == ["norton", "norton"]


def test_only_what_changed_is_done_again(tmp_path):
    screened(TWO, to=tmp_path)
    one = TWO[0].replace(outputs={"strain": 1.01 * TWO[0].outputs["strain"]})
    seen = []
    screened([one, *TWO[1:]], to=tmp_path, progress=lambda *told: seen.append(told[3].split()[0]))
    assert seen == ["X"]
    seen.clear()
    screened(
        TWO[3:], to=tmp_path, settings=dataclasses.replace(QUICK, seed=5), progress=lambda *t: seen.append(t[3][0])
    )
    assert seen == ["Y"]


def test_a_damaged_answer_is_worked_out_again(tmp_path, caplog):
    screened(TWO[:3], to=tmp_path)
    (tmp_path / "X.json").write_text("{}")
    assert screened(TWO[:3], to=tmp_path)["X"].identified
    assert "X.json: this is not the result of an alloy that creepkit wrote" in caplog.text


@pytest.mark.nightly
def test_workers_find_what_this_process_finds_and_one_that_dies_costs_one_alloy():
    deadly = [h.replace(specimen="deadly") for h in bars("D")]
    apart = screened([*deadly, *TWO[:3]], using={"uniaxial": specimen("uniaxial"), "deadly": Deadly()}, workers=2)
    assert apart.failures == {
        "D": "its worker process died 3 times, the last time by exit code 3; is there memory enough?"
    }
    assert apart["X"].best.values == screened(TWO[:3])["X"].best.values


# ---- bad input -----------------------------------------------------------------------------------------------------


def test_an_alloy_without_creep_does_not_stop_the_others(tmp_path):
    found = screened([bulge("a", "E", rise=0.0), *TWO[:3]], to=tmp_path)
    assert found["X"].identified
    assert list(found.failures) == ["E"]
    assert found.failures["E"].startswith("alloy 'E': elastic only, there is no creep to identify")
    assert "failed: alloy 'E': elastic only" in str(found)
    with pytest.raises(FitError, match="alloy 'E' has no identified law: alloy 'E': elastic only"):
        _ = found["E"].best


def test_compositions_may_lie_beside_the_tests(tmp_path):
    for history in bars("X"):
        write_history(history, tmp_path / f"{history.name}.csv")
    (tmp_path / "compositions.csv").write_text("# unit: wt.%\nalloy,Fe\nY,100\n")
    found = screened(tmp_path, compositions=tmp_path / "compositions.csv")
    assert found.class_of("X") == "unknown"
    assert found.notes[0].endswith("no alloy 'X', whose class stays unknown; known: Y")


def test_a_copy_of_a_test_is_left_out_with_a_note():
    tests = bars("X")
    plate = screened([*tests, tests[0].replace(name="again")])
    assert plate.notes == (f"left out: again: the same readings as {tests[0].name}: one test, which counts once",)
    assert [h.name for h in plate.histories["X"]] == [h.name for h in tests]


def test_the_table_has_a_row_an_alloy(plate, tmp_path):
    with plate.to_csv(tmp_path / "plate.csv").open() as stream:
        rows = {row["alloy"]: row for row in csv.DictReader(stream)}
    assert (rows["X"]["class"], rows["Y"]["class"]) == ("Fe-rich", "near-equimolar")
    rate = NORTON["A"] * 100.0 ** NORTON["n"]
    assert float(rows["X"]["rate_100MPa"]) == pytest.approx(rate, rel=0.05)
    assert float(rows["X"]["local_exponent_100MPa"]) == pytest.approx(NORTON["n"], abs=0.05)
    assert float(rows["X"]["n_low"]) < float(rows["X"]["n"]) < float(rows["X"]["n_high"])
    assert float(rows["X"]["loss_dense"]) == pytest.approx(float(rows["X"]["loss_reduced"]), rel=0.2)


# ---- alloys ----------------------------------------------------------------------------------------------------------

# What is wrong with the tests of an alloy, and what they leave open, in one sentence each.


BULGE = ck.specimen("bulge")


def test_growth_is_what_creeps_while_the_load_is_held():
    """A straight line of slope s: means of outer thirds lie two thirds of a hold apart, in each of two holds."""
    test = bulge(rise=0.0, noise=1e-9)
    slope = 1e-5
    outputs = {**test.outputs, "amplitude": test.outputs["amplitude"] + slope * test.times}
    found = detect_creep(test.replace(outputs=outputs), "amplitude")
    frames, every = 48, 150.0
    assert found.increase == pytest.approx(2 * slope * every * (frames * 2 / 3), rel=1e-6)


def test_the_standard_error_of_a_growth_is_that_of_many_draws():
    drawn = [detect_creep(bulge(rise=0.0, seed=k), "amplitude") for k in range(200)]
    assert np.std([g.increase for g in drawn]) == pytest.approx(np.mean([g.standard_error for g in drawn]), rel=0.15)
    assert not any(g.shows_creep for g in drawn)


def test_tests_of_another_specimen_need_a_predictor_of_their_own():
    mixed = Alloy("X", (bulge("a", "X"), *bars("X")))
    with pytest.raises(FitError, match=r"its tests are of different specimens \(bulge, uniaxial\) and using= predicts"):
        check_tests(mixed, BULGE)
    with pytest.raises(FitError, match="using= names predictors for bulge; add it"):
        check_tests(mixed, CompositePredictor({"bulge": BULGE}))
    both = CompositePredictor({"bulge": BULGE, "uniaxial": ck.specimen("uniaxial")})
    check_tests(mixed, both)
    assert "tests of several specimens (bulge, uniaxial) are identified together" in limitations(mixed, both)


def test_one_test_says_what_it_cannot_know():
    one = bulge("a", "X", outputs=("amplitude", "width")).replace(loading=PressureJump(8.0, 8.0, 7200.0))
    assert limitations(Alloy("X", (one,)), BULGE) == (
        "one test: how dimples or bars of this alloy differ cannot be known from it",
        "one level of load: strain and time hardening are nearly the same law then",
        "one temperature: the activation energy cannot be known",
        "no shape in 1 of 1 tests: the stress exponent is known the less",
    )


# ---- compositions ----------------------------------------------------------------------------------------------------

# Tables of compositions: atomic per cent, classes, and what is wrong with a table.


def written(folder, text):
    path = folder / "compositions.csv"
    path.write_text(text)
    return path


def test_weight_becomes_atomic_per_cent_as_in_a_textbook():
    """TiAl alloy of 64.0 wt.% Ti: Ti50Al50 by the masses 47.867 and 26.982 (50 at.% = 63.95 wt.%)."""
    found = atomic_percent({"Ti": 100 * 47.867 / (47.867 + 26.982), "Al": 100 * 26.982 / (47.867 + 26.982)})
    np.testing.assert_allclose([found["Ti"], found["Al"]], 50.0, rtol=1e-12)


def test_atomic_per_cent_of_316l_against_hand_arithmetic():
    """Fe 68, Cr 17, Ni 12, Mo 3 wt.%: moles 1.21766, .32695, .20445, .03127, in all 1.78033."""
    found = atomic_percent({"Fe": 68.0, "Cr": 17.0, "Ni": 12.0, "Mo": 3.0})
    expected = {"Fe": 68.395, "Cr": 18.365, "Ni": 11.484, "Mo": 1.756}
    assert found == pytest.approx(expected, abs=2e-3)


def test_classes_follow_the_principal_element_unless_the_second_is_near():
    table = Compositions({"a": {"Fe": 70.0, "Cr": 30.0}, "b": {"Co": 40.0, "Ni": 35.1, "Cr": 24.9}, "c": {"Ni": 100.0}})
    assert [table.class_of(name) for name in "abcd"] == ["Fe-rich", "near-equimolar", "Ni-rich", "unknown"]


def test_a_table_is_read_in_its_unit(tmp_path):
    weights = read_compositions(written(tmp_path, "# unit: wt.%\nalloy,Ti,Al\nX,63.951,36.049\n"))
    assert weights.atomic["X"] == pytest.approx({"Ti": 50.0, "Al": 50.0}, abs=1e-2)
    shares = read_compositions(written(tmp_path, "# unit: at.%\nalloy,Ti,Al,Nb\nX,50,50,\n"))
    assert shares.atomic["X"] == {"Ti": 50.0, "Al": 50.0}


def test_an_alloy_that_the_table_lacks_is_named():
    told = Compositions({"alloy 1": {"Fe": 100.0}}, "table.csv").missing(["alloy 1", "aloy 1"])
    assert told == (
        "table.csv: no alloy 'aloy 1', whose class stays unknown; did you mean 'alloy 1'? (known: alloy 1)",
    )
