"""Laws that tests cannot separate: known identities come out as such, and nothing else does."""

import numpy as np
import pytest

from creepkit.inverse.identify import identify
from creepkit.inverse.selection import rank
from creepkit.inverse.selection.discrimination import DISTINGUISHABLE_CHI_SQUARE, equivalent_laws
from creepkit.inverse.settings import IdentificationSettings
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.records import StressSteps, constant_stress
from helpers.planted_bars import BAR, END, SPL, M, N, bars
from helpers.steady_rate_predictor import Steady, planted

LIKELY = IdentificationSettings(starts=4, sobol_points=32, weights="likelihood", nuisances=())
HELD = [constant_stress(s, "stress") for s in (40.0, 50.0, 60.0)]
PL = {"A": 0.02 / END / 50.0**N, "n": N}


def ranking(laws, tests):
    return rank([identify(law, tests, BAR, settings=LIKELY) for law in laws])


def pairs(found):
    return {frozenset((e.first, e.second)): e for e in found}


@pytest.fixture(scope="module")
def hardening():
    laws = (STRAIN_HARDENING, TIME_HARDENING, NORTON)
    return ranking(laws, bars(STRAIN_HARDENING, SPL, HELD, seed=0))


def test_hardening_by_strain_and_by_time_are_one_law_at_constant_stress(hardening):
    (found,) = equivalent_laws(hardening)
    assert {found.first, found.second} == {"strain-hardening", "time-hardening"}
    assert found.chi_square < 1e-3
    assert "no test changes its load" in str(found)


def test_and_the_fitted_values_obey_the_identity(hardening):
    """n' = n/(1-m), m' = m/(1-m), A' = A^(1/(1-m)) (1-m)^(m/(1-m))."""
    fits = {r.fit.law.name: r.fit.values for r in hardening.laws}
    s, t = fits["strain-hardening"], fits["time-hardening"]
    q = 1.0 - s["m"]
    assert t["n"] == pytest.approx(s["n"] / q, rel=1e-4)
    assert t["m"] == pytest.approx(s["m"] / q, rel=1e-4)
    assert np.log(t["A"]) == pytest.approx(np.log(s["A"]) / q + s["m"] / q * np.log(q), rel=1e-4)
    assert s["n"] == pytest.approx(N, rel=0.02)
    assert s["m"] == pytest.approx(M, rel=0.02)


def test_after_a_change_of_stress_they_are_two():
    loadings = [*HELD[:2], StressSteps(((0.0, 40.0), (0.5 * END, 60.0)), "stress")]
    tests = bars(STRAIN_HARDENING, SPL, loadings, seed=0)
    assert equivalent_laws(ranking((STRAIN_HARDENING, TIME_HARDENING), tests)) == ()


def test_a_power_law_is_also_a_sinh_and_a_hardening_that_does_not_harden():
    found = pairs(equivalent_laws(ranking((STRAIN_HARDENING, HYPERBOLIC_SINE, NORTON), bars(NORTON, PL, HELD, seed=0))))
    nested = found[frozenset(("norton", "strain-hardening"))]
    assert nested.reduction == "m = 0"
    assert "strain-hardening with m = 0 is the other law, and the tests allow it" in nested.sentence
    sinh = found[frozenset(("norton", "hyperbolic-sine"))]
    assert sinh.reduction == ""
    assert "over 40 to 60 MPa their local exponents are" in sinh.sentence
    assert sinh.chi_square < DISTINGUISHABLE_CHI_SQUARE


def test_over_a_wide_range_of_stress_a_sinh_is_no_power_law():
    """The local exponent n s/B coth(s/B) goes from 3 to 3.4 x 3 here."""
    values = {"A": 1e-7 / np.sinh(1.0) ** 3, "n": 3.0, "B": 60.0}
    conditions = [(s, 1000.0) for s in (10.0, 30.0, 60.0, 120.0, 200.0)]
    tests = planted(HYPERBOLIC_SINE, values, conditions, seed=1, noise=1e-5)
    quick = IdentificationSettings(starts=3, sobol_points=16, frames=20, weights="likelihood", nuisances=())
    fits = [identify(law, tests, Steady(), settings=quick) for law in (HYPERBOLIC_SINE, NORTON)]
    assert equivalent_laws(rank(fits)) == ()


def test_identifications_not_made_by_likelihood_are_predicted_again():
    tests = planted(NORTON, PL, [(s, 1000.0) for s in (50.0, 55.0, 60.0)] * 2, seed=4, rate=0.05, noise=1e-5)
    fits = [identify(law, tests, Steady(), settings=IdentificationSettings(starts=3, sobol_points=16, frames=20))
            for law in (NORTON, HYPERBOLIC_SINE)]  # fmt: skip
    (found,) = equivalent_laws(rank(fits))
    assert found.chi_square < DISTINGUISHABLE_CHI_SQUARE
    assert "over 50 to 60 MPa" in found.sentence


def test_one_stress_is_said():
    tests = bars(NORTON, PL, HELD[:1], seed=2)
    (found,) = equivalent_laws(ranking((NORTON, HYPERBOLIC_SINE), tests))
    assert "every test holds one stress, 40 MPa" in found.sentence
