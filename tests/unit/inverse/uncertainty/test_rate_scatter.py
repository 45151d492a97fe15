"""Scatter of rates: balanced designs, where REML is the analysis of variance (Searle et al. (1992), chapter 4)."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import make_smoothing_spline
from scipy.optimize import minimize

import creepkit as ck
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.reference_conditions import ReferencePoint
from creepkit.inverse.uncertainty.law_misfit import LawMisfits
from creepkit.inverse.uncertainty.rate_scatter import FLAT_BELOW, REACH, USUAL_SD, RateScatter
from creepkit.laws.norton import NORTON
from helpers.rupture_tests import BAR


def scatter_of(log_factor, variance=0.0, heats=(), known=None):
    """Tests that say as much of one unknown, the mean, each."""
    count = len(log_factor)
    names = tuple(f"test {k}" for k in range(count))
    members = {"heat": tuple(heats)} if heats else {}
    return RateScatter(
        tests=names,
        members=members,
        log_factor=np.array(log_factor, float),
        variance=np.full(count, variance),
        design=np.ones((count, 1)),
        precision=np.full((1, 1), 1e-9),
        gradient=np.zeros(1),
        known=known,
    )


def test_without_heats_the_restricted_likelihood_is_largest_at_the_sample_variance():
    z = np.random.default_rng(1).normal(0.0, 0.2, 9)
    scatter = scatter_of(z, variance=0.01**2)
    best = minimize(lambda s: -scatter.solved(np.exp(s))[0], [np.log(0.1)]).x
    assert np.exp(2 * best[0]) == pytest.approx(z.var(ddof=1) - 0.01**2, rel=1e-3)


def test_with_heats_it_is_the_analysis_of_variance():
    rng = np.random.default_rng(5)
    heats, tests = 6, 4
    z = rng.normal(0.0, 0.3, heats)[:, None] + rng.normal(0.0, 0.1, (heats, tests))
    scatter = scatter_of(z.ravel(), 1e-8, [f"heat {k}" for k in range(heats) for _ in range(tests)])
    best = minimize(lambda s: -scatter.solved(np.exp(s))[0], np.log([0.3, 0.1]), tol=1e-10).x
    within = ((z - z.mean(axis=1, keepdims=True)) ** 2).sum() / (heats * (tests - 1))
    between = tests * z.mean(axis=1).var(ddof=1)
    assert np.exp(2 * best) == pytest.approx([(between - within) / tests, within], rel=1e-3)


def test_the_effect_of_a_heat_is_shrunk_as_its_reliability_says():
    z = np.array([0.3, 0.2, -0.2, -0.3])
    scatter = scatter_of(z, 1e-12, ["a", "a", "b", "b"])
    mean, covariance = scatter.joint(np.array([0.2, 0.1]))
    # Means of two tests differ by 0.5; the share of a heat's variance in that of its mean is .04 / (.04 + .01 / 2).
    assert mean[1:] == pytest.approx([0.25 * 0.04 / 0.045, -0.25 * 0.04 / 0.045], rel=1e-6)
    # Mean and effect of heat a together are what its two tests show, shrunk a little towards those of b: by hand, from
    # the covariance of (mean of a, mean of b), each .045, and a flat mean, var = .04 - .04^2 / .045 / 2 + ... below.
    row = np.array([1.0, 1.0, 0.0])
    within, between = 0.01 / 2, 0.04
    share = between / (between + within)
    expected = share * within + (1.0 - share) ** 2 * (between + within) / 2
    assert row @ covariance @ row == pytest.approx(expected, rel=1e-5)
    # An error that all tests have alike moves the rates of both heats by itself, and not the heats against each other.
    off = replace(scatter, errors=np.array([[0.09]]))
    assert row @ off.joint(np.array([0.2, 0.1]))[1] @ row == pytest.approx(expected + 0.09, rel=1e-5)


def test_the_unknowns_are_those_of_generalised_least_squares_about_the_estimate():
    z, variance = np.array([0.3, -0.1, 0.05]), 0.02
    mean, covariance = scatter_of(z, variance).joint(np.array([0.1]))
    assert mean[0] == 0.0
    assert covariance[0, 0] == pytest.approx((0.1**2 + variance) / 3 + z.mean() ** 2, rel=1e-6)


def test_the_posterior_distribution_integrates_to_that_of_the_prior_without_information():
    scatter = scatter_of([0.0], 1e-12)
    posterior = scatter.posterior
    # One test says nothing of a scatter; the prior by quadrature.
    usual, sd = USUAL_SD["test"], np.linspace(0.0, 4.0 * USUAL_SD["test"], 20001)
    density = np.exp(-0.5 * (sd / usual) ** 2) / (sd + FLAT_BELOW * usual)
    assert posterior.mean_square("test") == pytest.approx((density * sd**2).sum() / density.sum(), rel=0.02)


def test_intervals_of_the_mean_hold_as_often_as_those_of_student_whatever_the_scatter():
    """Of 5 and 9 tests that scatter by 0.1 to 1, with the expected square of it; 400 draws each."""
    rng, missed = np.random.default_rng(2), {}
    for count in (5, 9):
        drawn = rng.standard_normal((400, count))
        for sd in (0.1, 0.3, 1.0):
            held = []
            for z in sd * drawn:
                reach = max(1.0, REACH * z.std(ddof=1) / USUAL_SD["test"])
                square = replace(scatter_of(z - z.mean(), 1e-8), reach=reach).posterior.mean_square("test")
                held.append(abs(z.mean()) < 1.96 * np.sqrt(square / count))
            missed[count, sd] = 1.0 - float(np.mean(held))
    assert all(0.02 < share < 0.07 for share in missed.values()), missed


def bars(count, scatter, seed, noise=2e-6):
    """Norton bars at one stress, their strains in closed form, e = A s^n t."""
    rng = np.random.default_rng(seed)
    times = np.geomspace(3.6e3, 3.6e5, 40)
    factors = np.exp(rng.normal(0.0, scatter, count))
    return [
        ck.History(
            f"bar {k}",
            times,
            {"strain": 1e-8 * f * times + rng.normal(0.0, noise, times.size)},
            ck.constant_stress(100.0, "stress"),
            1073.15,
        )
        for k, f in enumerate(factors)
    ], np.log(factors)


def test_heats_and_laboratories_are_read_from_labels():
    tests, _ = bars(6, 0.1, 3)
    labelled = [h.replace(labels={"heat": "ab"[k % 2], "lab": "one"}) for k, h in enumerate(tests)]
    scatter = ck.identify(ck.law("norton").fix(n=5.0), labelled, using=BAR, starts=1).rate_scatter
    assert scatter.levels == ("heat", "test")
    assert scatter.members["heat"] == ("a", "b", "a", "b", "a", "b")
    assert scatter.common == {"laboratory": "one"}


def heats_of(*heats):
    tests, _ = bars(len(heats), 0.1, 3)
    labelled = [h.replace(labels={"heat": heat} if heat else {}) for h, heat in zip(tests, heats, strict=True)]
    return ck.identify(ck.law("norton").fix(n=5.0), labelled, using=BAR, starts=1)


def test_a_test_without_a_heat_makes_no_second_heat_beside_one_that_is_named():
    fit, labelled = heats_of(*"bbbb", "", "b"), heats_of(*"bbbbbb")
    assert fit.rate_scatter.levels == ("test",)
    assert fit.rate_scatter.common == labelled.rate_scatter.common == {"heat": "b"}
    assert [(e.value, e.low, e.high) for e in fit.estimates] == [(e.value, e.low, e.high) for e in labelled.estimates]
    assert f"{fit.histories[4].name} states no heat: taken for one of heat b, as the others are" in fit.notes
    assert not any("states no heat" in one for one in labelled.notes)


# ---- law misfit ------------------------------------------------------------------------------------------------------

# What a law misses beyond its tests: against smoothing splines, and planted rates that a power law cannot follow.


STRESSES = np.array([60.0, 70.0, 80.0, 95.0, 110.0, 130.0, 150.0, 60.0, 150.0])
REFERENCE = ReferencePoint(stress=95.0, strain=0.01, time=1e5, temperature=900.0)


def power_law(log_rates, stresses=STRESSES, scatter_known=None, temperatures=None):
    """A power law that is fitted to ln rates of bars by least squares; what each bar says of its own factor."""
    x = np.log(stresses / REFERENCE.stress)
    design = np.stack([np.ones_like(x), x], axis=1)
    values = np.linalg.lstsq(design, log_rates, rcond=None)[0]
    count = len(stresses)
    scatter = RateScatter(
        tests=tuple(f"bar {k}" for k in range(count)),
        members={},
        log_factor=log_rates - design @ values,
        variance=np.full(count, 1e-8),
        design=design,
        precision=1e-8 * np.eye(2),
        gradient=np.zeros(2),
        known=scatter_known,
        stresses=np.array(stresses, float),
        temperatures=np.full(count, 900.0) if temperatures is None else temperatures,
    )
    return LawMisfits(Coordinates(NORTON, REFERENCE), values, scatter), values


def sinh_rates(stresses):
    return 4.0 * np.log(np.sinh(np.asarray(stresses) / 60.0))


def test_it_is_the_smoothing_spline_of_the_factors_of_tests_amid_them_and_its_line_beyond():
    """Minimum of sum (y - g)^2 / s^2 + int g''^2 / q with q the variance of f''; knots an eighth of the span apart."""
    scatter, change = 0.1, 0.4
    y = sinh_rates(STRESSES) + scatter * np.random.default_rng(5).standard_normal(STRESSES.size)
    misfits, values = power_law(y)
    axis = misfits._axes[0]
    columns = axis.effects(axis.values)
    _, mean, _ = misfits.scatter.solved(np.array([scatter]), columns, np.full(columns.shape[1], change))
    points = np.log(np.array([40.0, 52.0, 66.0, 88.0, 120.0, 170.0]))
    about = points - np.log(REFERENCE.stress)
    found = values[0] + mean[0] + (values[1] + mean[1]) * about + axis.effects(points) @ mean[2:]
    order = np.argsort(STRESSES, kind="stable")
    x, same = np.unique(np.log(STRESSES[order]), return_inverse=True)
    means = np.array([y[order][same == k].mean() for k in range(x.size)])
    slope_variance = (change * axis.change) ** 2 / axis.span
    spline = make_smoothing_spline(x, means, w=np.bincount(same), lam=scatter**2 / slope_variance)
    inside = np.clip(points, x[0], x[-1])  # a natural spline is a line beyond
    expected = spline(inside) + spline.derivative()(inside) * (points - inside)
    np.testing.assert_allclose(found, expected, atol=0.03)


@pytest.mark.parametrize(("asked", "share"), [(40.0, 0.9), (200.0, 0.8)])
def test_beyond_the_tests_it_holds_what_a_power_law_misses_of_a_hyperbolic_sine(asked, share):
    """Of 30 campaigns; above the tests its exponent rises ever faster, as that of no wandering slope does."""
    rng, inside = np.random.default_rng(1), 0
    for _ in range(30):
        misfits, values = power_law(sinh_rates(STRESSES) + 0.08 * rng.standard_normal(STRESSES.size))
        error = sinh_rates(asked) - values[0] - values[1] * np.log(asked / REFERENCE.stress)
        inside += abs(error) < 1.96 * misfits.at(asked, 900.0).total
    assert inside >= share * 30


def test_a_law_that_follows_its_tests_is_hardly_doubted_amid_them_and_more_the_farther():
    y = 5.0 * np.log(STRESSES / 95.0) + 0.05 * np.random.default_rng(2).standard_normal(STRESSES.size)
    misfits, _ = power_law(y)
    near, below, far = (misfits.at(stress, 900.0) for stress in (95.0, 45.0, 25.0))
    assert near.sd < 0.05
    assert near.sd < below.sd < far.sd < 1.0
    assert below.test in ("bar 0", "bar 7")
    assert below.factor == pytest.approx(np.exp(1.96 * below.sd))


def test_the_tests_nearest_to_the_question_are_predicted_from_the_others():
    """Two bars at the lowest stress that creep twice as fast as a power law of the other seven says."""
    y = 5.0 * np.log(STRESSES / 95.0)
    y[[0, 7]] += np.log(2.0)
    found = power_law(y)[0].at(40.0, 900.0)
    assert found.stress == 60.0
    assert np.exp(found.log_factor) == pytest.approx(2.0, rel=0.1)


def test_intervals_of_rates_hold_it_outside_the_tests_and_a_file_keeps_it(tmp_path):
    """Bars of sinh(s / 60 MPa)^4, a power law, and a third below the lowest stress."""
    rng, times = np.random.default_rng(3), np.linspace(100.0, 1e6, 40)
    tests = [
        ck.History(
            f"bar {k}",
            times,
            {"strain": 1e-9 * (np.sinh(s / 60.0) / np.sinh(2.0)) ** 4 * np.exp(0.05 * rng.standard_normal()) * times},
            ck.constant_stress(float(s), control="stress"),
            900.0,
        )
        for k, s in enumerate(STRESSES)
    ]
    fit = ck.identify("norton", tests, starts=1)
    truth = 1e-9 * (np.sinh(40.0 / 60.0) / np.sinh(2.0)) ** 4
    _, low, high = fit.rate(40.0, warn=False)
    assert low < truth < high
    inside = fit.rate(95.0, warn=False)
    assert np.log(high / low) > 3.0 * np.log(inside[2] / inside[1])
    loaded = ck.load(fit.save(tmp_path / "fit.json"))
    assert loaded.rate(40.0, warn=False)[1:] == pytest.approx((low, high), rel=1e-6)
    plan = ck.History("plan", np.geomspace(1e5, 1e9, 20), {}, ck.constant_stress(40.0, control="stress"), 900.0)
    made = ck.forecast(fit, plan, draws=400).tests[0]
    assert made.misfit.factor > 1.5
    assert made.times[0].low < 0.01 / truth < made.times[0].high
