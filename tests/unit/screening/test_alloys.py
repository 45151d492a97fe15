"""What is wrong with the tests of an alloy, and what they leave open, in one sentence each."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import FitError
from creepkit.inverse.composite_predictor import CompositePredictor
from creepkit.inverse.reference_conditions import detect_creep
from creepkit.records import PressureJump
from creepkit.screening.alloys import Alloy, check_tests, group_by_alloy, limitations
from creepkit.specimens.bulge.outputs import profile_displacement
from helpers.planted_alloys import bars, bulge

BULGE = ck.specimen("bulge")


def test_tests_are_grouped_by_alloy_and_one_without_is_its_own():
    found = group_by_alloy([bulge("a", "X"), bulge("b"), bulge("c", "X")])
    assert [(alloy.name, [t.name for t in alloy.tests]) for alloy in found] == [("X", ["a", "c"]), ("b", ["b"])]


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


def test_elastic_data_have_no_creep_to_identify():
    with pytest.raises(
        FitError, match="alloy 'X': elastic only, there is no creep to identify: its amplitude grows by"
    ):
        check_tests(Alloy("X", (bulge("a", "X", rise=0.0),)), BULGE)


def test_tests_of_another_specimen_need_a_predictor_of_their_own():
    mixed = Alloy("X", (bulge("a", "X"), *bars("X")))
    with pytest.raises(FitError, match=r"its tests are of different specimens \(bulge, uniaxial\) and using= predicts"):
        check_tests(mixed, BULGE)
    with pytest.raises(FitError, match="using= names predictors for bulge; add it"):
        check_tests(mixed, CompositePredictor({"bulge": BULGE}))
    both = CompositePredictor({"bulge": BULGE, "uniaxial": ck.specimen("uniaxial")})
    check_tests(mixed, both)
    assert "tests of several specimens (bulge, uniaxial) are identified together" in limitations(mixed, both)


def test_without_the_leading_output_creep_cannot_be_told():
    with pytest.raises(FitError, match="test 'a' has no amplitude, without which creep cannot be seen; it has width"):
        check_tests(Alloy("X", (bulge("a", "X", outputs=("width",)),)), BULGE)


def test_displacement_at_a_radius_is_equation_3():
    rows = {"amplitude": np.array([0.5, 0.5]), "width": np.array([4.0, 4.0]), "shape": np.array([2.0, 2.0])}
    np.testing.assert_allclose(profile_displacement(rows, 4.0), 0.5 / np.e, rtol=1e-14)
    np.testing.assert_allclose(profile_displacement(rows, 2.0), 0.5 * np.exp(-0.25), rtol=1e-14)
    assert np.isnan(profile_displacement({"amplitude": np.ones(2)}, 2.0)).all()
    np.testing.assert_array_equal(profile_displacement({"amplitude": np.ones(2)}, 0.0), 1.0)


def test_one_creeping_test_is_enough():
    check_tests(Alloy("X", (bulge("a", "X", rise=0.0), bulge("b", "X", rise=0.05))), BULGE)


def test_one_test_says_what_it_cannot_know():
    one = bulge("a", "X", outputs=("amplitude", "width")).replace(loading=PressureJump(8.0, 8.0, 7200.0))
    assert limitations(Alloy("X", (one,)), BULGE) == (
        "one test: how dimples or bars of this alloy differ cannot be known from it",
        "one level of load: strain and time hardening are nearly the same law then",
        "one temperature: the activation energy cannot be known",
        "no shape in 1 of 1 tests: the stress exponent is known the less",
    )
