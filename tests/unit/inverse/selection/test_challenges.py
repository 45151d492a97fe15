"""Challenges: planted sums, thresholds and drifts are not decided against, and single laws stand what tests exclude."""

import re
from dataclasses import replace

import numpy as np
import pytest
import sympy

import creepkit as ck
from creepkit.inverse.identify import identify
from creepkit.inverse.selection import rank
from creepkit.inverse.selection.challenges import (
    NOT_EXCLUDED,
    SHARE,
    THRESHOLD,
    FittedLaw,
    ShareResidual,
    _chi_square,
    _comparison_text,
    _least_excess,
    altered_laws,
    challenges_of,
)
from creepkit.inverse.settings import IdentificationSettings
from creepkit.language import Param, arrhenius, stress
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.records import History
from helpers.steady_rate_predictor import Steady, planted

SETTINGS = IdentificationSettings(starts=2, sobol_points=16, frames=20, weights="likelihood", nuisances=())
WIDE = tuple((s, 1000.0) for s in (15.0, 25.0, 40.0, 60.0, 90.0, 130.0, 170.0, 200.0))
NARROW = tuple((s, 1000.0) for s in (55.0, 60.0, 65.0))
POWER = {"A": 1e-15, "n": 4.0}
SINH = {"A": 1e-7, "n": 3.0, "B": 60.0}


def steady(law, values, conditions, *, noise, seed=0):
    """Tests with noise that is stated."""
    made = planted(law, values, conditions, seed=seed, noise=noise)
    return [h.replace(standard_deviation={"strain": np.full(h.times.size, noise)}) for h in made]


def fits_of(tests, laws=(NORTON, HYPERBOLIC_SINE)):
    return [identify(law, tests, Steady(), settings=SETTINGS) for law in laws]


@pytest.fixture(scope="module")
def power_law_narrow():
    return fits_of(steady(NORTON, POWER, NARROW, noise=2e-4))


@pytest.fixture(scope="module")
def power_law_wide():
    return fits_of(steady(NORTON, POWER, WIDE, noise=2e-5), (NORTON,))


@pytest.fixture(scope="module")
def sinh_wide():
    return fits_of(steady(HYPERBOLIC_SINE, SINH, WIDE, noise=2e-5))


# ---- sums --------------------------------------------------------------------------------------------------------


def test_a_share_of_another_law_is_excluded_by_many_stresses_and_little_noise(sinh_wide):
    """Over 15 to 200 MPa the local exponent of the sinh goes from 3 to 10: no 30 % of a power law fit in beside it."""
    norton, sinh = sinh_wide
    assert [one.kind for one in altered_laws([sinh, norton])] in ([], ["threshold"])


def test_a_share_of_another_law_is_not_excluded_by_a_narrow_range(power_law_narrow):
    """Over 55 to 65 MPa a power law is a sinh too."""
    found = challenges_of(power_law_narrow)[0]
    assert found.kind == "sum"
    assert found.subject == "norton+hyperbolic-sine"
    assert found.sentence.startswith(
        "its sum with hyperbolic-sine, tried with 30 % of the rate carried by it, explains them as well (its "
    )


def test_a_planted_sum_of_two_fifths_is_not_decided_against():
    """60 % with n = 3 and 40 % with n = 5 at 60 MPa, which a single law follows within the noise."""
    law, rate = NORTON + NORTON, 1e-8
    values = {"A_1": 0.6 * rate / 60.0**3, "n_1": 3.0, "A_2": 0.4 * rate / 60.0**5, "n_2": 5.0}
    conditions = [(s, 1000.0) for s in (50.0, 60.0, 72.0)]
    for seed in range(3):
        found = rank(fits_of(steady(law, values, conditions, noise=2e-4, seed=seed)))
        assert not found.decisive
        assert found.verdict.startswith("not decisive")


def test_no_law_is_added_to_a_sum_that_holds_it(power_law_narrow):
    """Norton's law and a sum with it: the sum of both has Norton's law as a case, and no test could exclude it."""
    norton, sinh = power_law_narrow
    both = replace(norton, law=replace(norton.law, name="norton+hyperbolic-sine"))
    assert [one.other for one in altered_laws([norton, both, sinh]) if one.kind == "sum"] == ["hyperbolic-sine"]
    assert [one.other for one in altered_laws([both, norton, sinh]) if one.kind == "sum"] == []


def test_the_share_is_held_in_the_fit(power_law_narrow):
    """At the least chi-square the ratio of the rates at the reference point is still that of the start."""
    share = ShareResidual([0], [2], float(np.log(SHARE / (1 - SHARE))))
    x = np.array([-15.0, 4.0, -16.0])
    assert share.residuals(x) == pytest.approx((-1.0 - np.log(SHARE / (1 - SHARE))) / 1e-3)
    assert share.jacobian(x) == pytest.approx(np.array([[-1e3, 0.0, 1e3]]))
    best, _ = power_law_narrow
    single = best.least_squares_problem
    assert _chi_square(single, best.x) == pytest.approx(
        float((single.whiten(single.residuals(best.x).values) ** 2).sum())
    )
    assert _least_excess(FittedLaw.of(best), single, best.x + 0.05)[0] == pytest.approx(0.0, abs=0.02)
    assert NOT_EXCLUDED == pytest.approx(1.96**2, abs=1e-3)


def test_the_share_is_that_of_all_terms_of_a_law():
    """30 % of the sum of two terms against one of the other law, and derivatives as differences say."""
    share = ShareResidual([0, 1], [3], float(np.log(0.3 / 0.7)))
    x = np.array([np.log(0.2), np.log(0.5), 7.0, np.log(0.3)])
    assert share.residuals(x) == pytest.approx(0.0, abs=1e-9)
    step = 1e-6 * np.eye(4)
    differences = [(share.residuals(x + d) - share.residuals(x - d)) / 2e-6 for d in step]
    np.testing.assert_allclose(share.jacobian(x), np.transpose(differences), rtol=1e-6, atol=1e-6)


def test_values_by_equal_weights_are_judged_where_their_own_chi_square_is_least():
    """A law cannot be beaten by itself: refined from elsewhere under the same covariance it is not lower."""
    tests = steady(NORTON, POWER, WIDE, noise=2e-4)
    fit = identify(
        NORTON, tests, Steady(), settings=replace(SETTINGS, weights="noise", nuisances=(ck.Nuisance("rate"),))
    )
    best = FittedLaw.at_least_chi_square(fit)
    assert _chi_square(best.problem, best.x) < _chi_square(best.problem, fit.x)
    assert _least_excess(best, best.problem, fit.x + 0.05)[0] == pytest.approx(0.0, abs=0.02)


# ---- thresholds --------------------------------------------------------------------------------------------------


def above_a_threshold():
    """Norton's law above a threshold stress s_0."""
    s_0 = sympy.Symbol("s_0", real=True)
    terms = {label: term.subs(stress, sympy.Max(stress - s_0, 0)) for label, term in NORTON.terms.items()}
    params = {**NORTON.params, s_0: Param("threshold", unit="MPa", bounds=(0.0, 50.0))}
    return replace(NORTON, name="threshold", terms=terms, params=params)


def test_a_threshold_is_excluded_by_a_wide_range_of_stress(power_law_wide):
    assert altered_laws(power_law_wide) == []


def test_a_planted_threshold_that_a_power_law_follows_is_not_decided_against():
    """(s - 12)^3.2 over 55 to 65 MPa is s^4 within the noise; a fifth of 60 MPa is 12."""
    tests = steady(above_a_threshold(), {"A": 3e-14, "n": 3.2, "s_0": 12.0}, NARROW, noise=2e-4)
    norton = fits_of(tests, (NORTON,))[0]
    assert norton.adequacy.explains
    (found,) = challenges_of([norton])
    assert found.kind == "threshold"
    assert found.subject == "norton above a threshold"
    assert f"of {THRESHOLD * norton.reference.stress:.3g} MPa explains them as well" in found.sentence


# ---- unmodelled effects ------------------------------------------------------------------------------------------


def test_what_rests_on_a_furnace_that_nobody_watched_is_not_decisive():
    """Strain hardening at three stresses; test_select decides for it where the temperature was recorded."""
    rng, bar, times = np.random.default_rng(0), ck.specimen("uniaxial"), np.geomspace(600.0, 4e5, 40)
    values, tests = {"A": 5e-16, "n": 4.0, "m": -0.4}, []
    for level in (60.0, 85.0, 120.0):
        run = ck.simulate("strain-hardening", bar, values, loading=ck.constant_stress(level), times=times)
        strain = run.outputs["strain"] + 2e-4 * rng.standard_normal(times.size)
        sd = {"strain": np.full(times.size, 2e-4)}
        tests.append(History(f"{level:g} MPa", times, {"strain": strain}, run.loading, 293.15, standard_deviation=sd))
    laws, settings = [ck.law("strain-hardening"), ck.law("time-hardening")], replace(SETTINGS, frames=40, starts=1)
    found = rank([identify(law, tests, bar, settings=settings) for law in laws])
    assert found.singled_out
    assert not found.decisive
    (drift,) = (c for c in found.challenges if c.kind == "unmodelled effect")
    assert drift.subject == "temperature drift"
    size = r"with independent drifts of the temperature of up to ([\d.]+) K over each of the 3 tests"
    said = re.fullmatch(rf"{size} time-hardening would explain them \(weight 0\.\d\d\)", drift.sentence)
    assert 0.0 < float(said[1]) < 5.0
    assert str(drift) == drift.sentence
    assert drift.sentence in found.verdict


# ---- example data ------------------------------------------------------------------------------------------------


def test_the_planted_example_is_decisive():
    """Nine curves of strain hardening at several stresses and temperatures, steps of stress among them."""
    tests = ck.read_histories(ck.example_data("planted creep curves"))
    names = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine")
    laws = [ck.law(name).times(arrhenius()) for name in names]
    found = ck.select(laws, tests, "uniaxial", starts=1, sobol_points=8, frames=16)
    assert found.decisive
    assert found.best.law.name == "strain-hardening*arrhenius"
    assert found.challenges == ()
    assert challenges_of([r.fit for r in found.laws]) == ()


def test_what_fits_better_is_said_to_fit_better():
    """3.84 is 95 % of chi-square with one degree of freedom: beyond it, two laws do not explain tests equally well."""
    assert _comparison_text(-48.6) == "fits better (its chi-square is 48.6 lower)"
    assert _comparison_text(-1.2) == "explains them as well (its chi-square is 1.2 lower)"
    assert _comparison_text(2.0) == "explains them as well (its chi-square is 2.0 higher)"
    assert _comparison_text(-0.01) == "explains them as well (its chi-square is the same)"
