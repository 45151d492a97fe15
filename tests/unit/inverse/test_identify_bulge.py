"""identify() on bulge tests of one degree of freedom: several outputs, unknown thicknesses, a bad test, weights."""

from dataclasses import replace

import numpy as np
import pytest

from creepkit.errors import FitError
from creepkit.inverse.cross_validation import cross_validate
from creepkit.inverse.identification import IdentificationSettings
from creepkit.inverse.identify import identify
from creepkit.language import arrhenius
from creepkit.laws.norton import NORTON
from creepkit.records import Nuisance
from helpers.reduced_bulge_predictor import OneDegree, Plan, planted
from helpers.steady_rate_predictor import Steady
from helpers.steady_rate_predictor import planted as planted_bars

LAW = NORTON.times(arrhenius(T_ref=1048.15))
TRUTH = {"A": 3e-16, "n": 4.5, "Q": 420e3}
WARMTH = (740, 770, 790, 800, 760, 780, 810)
PRESSURES = (8, 10, 8, 9, 11, 8, 7)
MEAN, SPREAD, OFFSET = 0.4935, 0.02, 0.005
BOTH = (Nuisance("offset"), Nuisance("rate"))
THICKNESS = Nuisance("thickness", mean=MEAN, sd=SPREAD)
QUICK = IdentificationSettings(starts=1, sobol_points=8, frames=20, usual_errors="none")
WITH_THICKNESS = replace(QUICK, nuisances=(*BOTH, THICKNESS))


def plans(seed=3, thickness=SPREAD, offset=OFFSET):
    rng = np.random.default_rng(seed)
    return [
        Plan(c, p, 1.2 * p, thickness=MEAN + thickness * rng.normal(), offset=offset * rng.normal())
        for c, p in zip(WARMTH, PRESSURES, strict=True)
    ]


PLANS = plans()
EXACT = OneDegree(exact=True)


@pytest.fixture(scope="module")
def tests():
    return planted(LAW, TRUTH, PLANS, seed=103, frames=24)


@pytest.fixture(scope="module")
def fit(tests):
    return identify(LAW, tests, EXACT, settings=WITH_THICKNESS)


def inside(fit, truth=TRUTH):
    return {e.name: e.low <= truth[e.name] <= e.high for e in fit.estimates}


# ---- unknown thickness and offset ----------------------------------------------------------------------------------


def test_planted_law_lies_in_its_intervals_though_thicknesses_differ(fit):
    assert all(inside(fit).values())
    assert all(e.verdict == "determined" for e in fit.estimates)


def test_each_thickness_and_offset_is_found(fit):
    """Seven thicknesses with their stated sd: the root mean square of errors over sd of seven draws lies below 1.9."""
    errors = [(n.value - p.thickness) / n.sd for n, p in zip(fit.nuisances, PLANS, strict=True)]
    assert np.sqrt(np.mean(np.square(errors))) < 1.9
    assert all(n.sd < 0.5 * SPREAD for n in fit.nuisances)
    found = [m["amplitude"].offset for m in fit.tests]
    np.testing.assert_allclose(found, [p.offset for p in PLANS], atol=0.004)


def test_an_unknown_spread_is_estimated():
    """The spread of seven draws about a known mean: a standard error of 27 %, so a factor of two is three of them."""
    many = planted(LAW, TRUTH, plans(seed=8), seed=5, frames=24)
    fit = identify(LAW, many, EXACT, settings=replace(QUICK, nuisances=(*BOTH, Nuisance("thickness", mean=MEAN))))
    assert SPREAD / 2 < fit.nuisances[0].prior_sd < 2 * SPREAD
    assert "spread estimated" in fit.details()


def test_one_temperature_error_of_all_tests():
    """All thermocouples read 8 K low; a prior of 10 K and a known rate from elsewhere (fixed Q, n, A) find it."""
    off = [replace(p, thickness=0.5, offset=0.0, temperature=8.0) for p in PLANS]
    tests = planted(LAW, TRUTH, off, seed=2, frames=24)
    fixed = LAW.fix(A=TRUTH["A"], Q=TRUTH["Q"])
    shared = Nuisance("temperature", scope="all", sd=10.0)
    fit = identify(fixed, tests, EXACT, settings=replace(QUICK, nuisances=(Nuisance("offset"), shared)))
    (warmth,) = fit.nuisances
    assert warmth.owner == "all"
    assert abs(warmth.value - 8.0) < 4 * warmth.sd
    assert warmth.sd < 2.0


def test_intervals_cover_where_thicknesses_and_rates_scatter():
    """Twelve campaigns, rates scattering by 10 % beside thicknesses by 4 %: of 36 intervals of 95 % at least 30 hold.

    Thicknesses take up most of the scatter of the rate; intervals that believed them would hold in three of four.
    """
    held = 0
    for seed in range(12):
        rng = np.random.default_rng(seed + 40)
        scattered = [replace(p, rate=np.exp(0.1 * rng.normal())) for p in plans(seed)]
        tests = planted(LAW, TRUTH, scattered, seed=seed, frames=24)
        held += sum(inside(identify(LAW, tests, EXACT, settings=replace(WITH_THICKNESS, frames=12))).values())
    assert held >= 30


# ---- outputs, predictors -------------------------------------------------------------------------------------------


def test_a_history_may_lack_outputs_and_frames(fit, tests):
    """Amplitude alone in one test, a hole in the width of another: the rest still counts, and the law is found."""
    partial = list(tests)
    partial[0] = tests[0].replace(outputs={"amplitude": tests[0].outputs["amplitude"]})
    holed = np.where(np.arange(24) == 5, np.nan, tests[1].outputs["width"])
    partial[1] = tests[1].replace(outputs={**tests[1].outputs, "width": holed})
    some = identify(LAW, partial, EXACT, settings=replace(WITH_THICKNESS, frames=24))
    assert [o.output for o in some.tests[0].outputs] == ["amplitude"]
    assert some.tests[1]["width"].errors.frames == 23
    assert some.tests[1]["amplitude"].errors.frames == 24
    assert all(inside(some).values())


def test_derivatives_by_differences_give_the_same_answer(fit, tests):
    other = identify(LAW, tests, OneDegree(exact=False), settings=WITH_THICKNESS)
    assert (np.abs(other.u - fit.u) < 1e-2 * np.sqrt(np.diag(fit.covariance))).all()


def test_an_expensive_predictor_is_searched_with_its_stand_in(fit, tests):
    """The stand-in creeps 10 % too fast: the answer must not, and few evaluations may be of the real one."""
    other = identify(LAW, tests, OneDegree(exact=True, stand_in=True), settings=WITH_THICKNESS)
    assert (np.abs(other.u - fit.u) < 0.05 * np.sqrt(np.diag(fit.covariance))).all()
    assert 0 < other.provenance["evaluations"] < 80
    assert other.provenance["search_evaluations"] > 0


def test_bars_and_bulges_are_fitted_together(tests):
    """Uniaxial and bulge tests of one alloy, each with its own predictor; the bars narrow the exponent."""
    bars = planted_bars(LAW, TRUTH, [(s, T) for s in (80.0, 150.0) for T in (1023.0, 1073.0)], seed=1, noise=1e-5)
    using = {"one-degree": EXACT, "uniaxial": Steady()}
    fit = identify(LAW, [*tests, *bars], using, settings=replace(QUICK, nuisances=(Nuisance("offset"), THICKNESS)))
    assert set(fit.errors) == {"amplitude", "width", "shape", "strain"}
    assert all(inside(fit).values())
    assert len(fit.nuisances) == len(tests)
    assert "rms of ln strain" in fit.details()
    with pytest.raises(FitError, match="of specimen 'uniaxial', for which using= names no predictor"):
        identify(LAW, [*tests, *bars], {"one-degree": EXACT}, settings=QUICK)


# ---- what comes out ------------------------------------------------------------------------------------------------


def test_a_test_that_was_left_out_is_predicted(fit, tests):
    """Thicknesses of unseen tests are only known to 4 %, which is a quarter of the rate: errors far above the noise."""
    held = cross_validate(fit, tests[:3], by="test")
    assert list(held.errors) == [h.name for h in tests[:3]]
    assert all(len(fold.fit.tests) == 2 for fold in held.folds)
    assert all(np.isfinite(errors["amplitude"].relative_squared_error) for errors in held.errors.values())
    assert held.pooled_error("amplitude") > fit.errors["amplitude"].relative_squared_error


# ---- what cannot be ------------------------------------------------------------------------------------------------
