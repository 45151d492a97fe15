"""What would separate two laws: expected chi-squares against linear regression, and tests that must come out best."""

import numpy as np
import pytest

from creepkit.errors import FitError
from creepkit.experiments.candidate_tests import candidate_tests
from creepkit.experiments.discriminating_experiments import discriminating_experiments, further_tests
from creepkit.inverse.identify import identify
from creepkit.inverse.selection import rank
from creepkit.inverse.settings import IdentificationSettings
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.records import PressureJump, StressSteps, constant_strain, constant_stress
from creepkit.specimens.bulge.specimen import Bulge
from helpers.log_rate_predictor import END, known_scatter, measured
from helpers.planted_bars import BAR, SPL, bars

TRUTH = {"A": float(np.exp(-15.0 - 5.0 * np.log(50.0))), "n": 5.0}
SD = 0.2
APEX = Bulge().geometry.apex_thickness
LIKELY = IdentificationSettings(starts=4, sobol_points=32, weights="likelihood", nuisances=())


@pytest.fixture(scope="module")
def slopes():
    """ln rate has a slope of 5 in ln stress in truth; the other law says 3, and fits its level alone."""
    tests = measured(NORTON, TRUTH, (40.0, 50.0, 60.0), sd=SD, seed=1)
    return known_scatter(NORTON, tests, SD), known_scatter(NORTON.fix(n=3).rename("three"), tests, SD)


def expected(fit, stresses, frames=10):
    """Squares about the best level of what a wrong slope leaves."""
    x = np.repeat(np.log(stresses), frames)
    return float((((fit.values["n"] - 3.0) * (x - x.mean())) ** 2).sum() / SD**2)


def test_expected_chi_squares_are_those_of_regression(slopes):
    right, wrong = slopes
    plans = [h.replace(outputs={}, standard_deviation={}) for h in measured(NORTON, TRUTH, (50.0, 80.0), sd=SD)]
    found = discriminating_experiments(right, wrong, plans)
    assert found.current_chi_square == pytest.approx(expected(right, [40.0, 50.0, 60.0]), rel=1e-3)
    assert [t.description for t in found.experiments] == ["1: 80 MPa", "0: 50 MPa"]
    for test, stress in zip(found.experiments, (80.0, 50.0), strict=True):
        assert test.chi_square == pytest.approx(expected(right, [40.0, 50.0, 60.0, stress]), rel=1e-3)
    assert f"one more test, 1: 80 MPa, would bring it to {found.experiments[0].chi_square:.2g}" in found.sentence


def test_the_richer_law_is_never_worse(slopes):
    """Norton with a free exponent can be any law with n = 3: no test separates it if that is true."""
    found = discriminating_experiments(slopes[1], slopes[0])
    assert found.current_chi_square < 0.01
    assert max(t.chi_square for t in found.experiments) < 0.01
    assert "brings it above 5.9" in found.sentence


@pytest.fixture(scope="module")
def hardening():
    tests = bars(STRAIN_HARDENING, SPL, [constant_stress(s, "stress") for s in (40.0, 50.0, 60.0)], seed=0)
    return [identify(law, tests, BAR, settings=LIKELY) for law in (STRAIN_HARDENING, TIME_HARDENING)]


def test_a_change_of_stress_separates_hardening_by_strain_from_hardening_by_time(hardening):
    """At constant stress both are one law (n' = n/(1-m), m' = m/(1-m)); after a change they part."""
    found = discriminating_experiments(*hardening)
    assert found.current_chi_square < 1e-3
    assert ", from " in found.experiments[0].description
    assert found.experiments[0].chi_square > 1000
    steady = [t for t in found.experiments if ", from " not in t.description]
    assert max(t.chi_square for t in steady) < 0.01
    assert str(found).startswith("if strain-hardening holds, time-hardening is worse by an expected chi-square of")


def test_the_best_law_of_a_ranking_is_set_against_the_others_that_remain(hardening):
    found = further_tests(rank(hardening))
    assert len(found) == 1
    assert {found[0].reference_law, found[0].alternative_law} == {"strain-hardening", "time-hardening"}
    assert found[0].experiments[0].chi_square > 1000


def test_what_bursts_at_once_is_left_out(hardening):
    far = constant_stress(4000.0, "stress")
    plan = hardening[0].histories[0].replace(loading=far, name="far too much")
    found = discriminating_experiments(*hardening, [plan])
    assert found.experiments == ()
    assert found.excluded == ("far too much",)
    assert "none of the 0 further tests" in found.sentence


def test_fits_of_different_tests_are_refused(hardening, slopes):
    with pytest.raises(FitError, match="made from different histories"):
        discriminating_experiments(hardening[0], slopes[0])


def test_variations_are_of_the_longest_test():
    base = measured(NORTON, TRUTH, (40.0, 60.0), sd=SD)
    found = candidate_tests(base, exponent=4.0)
    levels = [d.history.loading.program().values for d in found]
    assert [float(v[0]) for v in levels[:3]] == pytest.approx([28.0, 84.0, 120.0])
    assert [float(d.history.times[-1]) for d in found[:3]] == pytest.approx(
        [2 * END, END * (84 / 40) ** -4, END * (120 / 40) ** -4]
    )
    assert all(float(d.history.times[0]) == pytest.approx(0.1 * float(d.history.times[-1])) for d in found)
    assert any(np.ptp(v) > 0 for v in levels)
    assert float(found[-1].history.times[-1]) == pytest.approx(2 * END)
    assert all(d.history.outputs == {} for d in found)


def test_variations_of_bulge_tests_change_pressure_and_thickness():
    (base,) = measured(NORTON, TRUTH, (50.0,), sd=SD)
    bulge = base.replace(loading=PressureJump(8.0, 10.0, 14400.0), specimen="bulge", geometry={"apex_thickness": 0.5})
    found = candidate_tests([bulge])
    told = [d.description for d in found]
    assert any("a constant 14 MPa" in t for t in told)
    assert any("8 MPa, from" in t and "on 14 MPa" in t for t in told)
    assert {d.history.geometry["apex_thickness"] for d in found} == {0.5, 0.45, 0.55}
    bare = bulge.replace(geometry={})
    assert len(candidate_tests([bare])) == len(found) - 2
    assert {d.history.geometry["apex_thickness"] for d in candidate_tests([bare], predictor=Bulge())} >= {
        0.9 * APEX,
        1.1 * APEX,
    }


def test_variations_of_relaxation_change_the_strain_and_others_are_asked_for():
    (base,) = measured(NORTON, TRUTH, (50.0,), sd=SD)
    assert len(candidate_tests([base.replace(loading=constant_strain(0.002))])) == 4

    class Odd:
        quantity = "components"

        def program(self):
            return StressSteps(((0.0, 1.0),)).program()

    with pytest.raises(FitError, match="no further tests are known for a loading by components"):
        candidate_tests([base.replace(loading=Odd())])
