"""Sentences and cells that state what the tests say: their numbers against rankings, bounds and closed forms."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

import creepkit as ck
from creepkit.forecasts.results import TimeForecast
from creepkit.inverse.identify import identify
from creepkit.inverse.selection.discrimination import chi_square_by_test
from creepkit.inverse.selection.ranking import Ranking, rank
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.uncertainty.laplace_approximation import Estimate, bound_marks, interval_ends
from creepkit.inverse.unmodelled_effect import UnmodelledEffect, combined_change_text
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.reports import stress_exponents
from creepkit.reports.figures import empty_figure
from creepkit.reports.forecast import _time_text
from creepkit.reports.forecast_plot import _draw_times
from creepkit.reports.html.elements import number, with_interval
from creepkit.reports.html.groups import _separation
from creepkit.reports.judged_readings import judged_readings
from creepkit.reports.stress_exponents import interval_digits, reference_sentences
from helpers.steady_rate_predictor import Steady, planted

SETTINGS = IdentificationSettings(starts=2, sobol_points=16, nuisances=())


@cache
def ranking(weights: str, *, wide: bool) -> Ranking:
    """Of a hyperbolic sine, over a range of stress in which a power law is another law, or in which it is not."""
    stresses = (20.0, 40.0, 80.0, 120.0) if wide else (60.0, 60.5, 61.0, 61.5)
    values = {"A": 1e-9, "B": 33.0, "n": 2.0}
    tests = planted(HYPERBOLIC_SINE, values, [(s, 1000.0) for s in stresses], seed=2, noise=3e-4)
    settings = replace(SETTINGS, weights=weights)
    return rank([identify(law, tests, Steady(), settings=settings) for law in (NORTON, HYPERBOLIC_SINE)])


# ---- what separates two laws ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("weights", ["likelihood", "noise"])
def test_what_separates_two_laws_is_stated_by_the_number_of_the_ranking(weights: str) -> None:
    found = ranking(weights, wide=True)
    (text,) = _separation(found)
    assert text.endswith(f"is {number(found.laws[1].excess, 3)} larger in all.")
    share = float(re.findall(r"(\d+) % of the chi-square", text)[0])
    assert 25.0 <= share <= 100.0  # the largest of four


@pytest.mark.parametrize("weights", ["likelihood", "noise"])
def test_nothing_separates_laws_that_predict_the_same(weights: str) -> None:
    assert _separation(ranking(weights, wide=False)) == []


def test_laws_of_equal_weights_are_compared_at_their_optima_under_the_common_covariance() -> None:
    """No other values of a law have a smaller chi-square there: those of the identification itself have none."""
    fits = [one.fit for one in ranking("noise", wide=True).laws]
    at_optimum = chi_square_by_test(fits).sum(axis=1)
    problem = fits[0].least_squares_problem
    for fit, least in zip(fits, at_optimum, strict=True):
        own = fit.least_squares_problem
        for u in (fit.x, fit.x + 1e-3, fit.x - 1e-3):
            assert least <= float((problem.whiten(own.residuals(u).values) ** 2).sum()) * (1.0 + 1e-6)


# ---- intervals ------------------------------------------------------------------------------------------------------


def test_ends_of_intervals_that_are_bounds_of_the_search_say_so() -> None:
    low, high = NORTON.table["n"].bounds
    cut = Estimate("n", 0.5 * (low + high), low, high, "1", "not determined")
    free = replace(cut, low=low + 1.0, high=high - 1.0, verdict="determined")
    assert interval_ends(NORTON, cut) == (f"{low:.4g} (search bound)", f"{high:.4g} (search bound)")
    assert interval_ends(NORTON, free) == (f"{low + 1.0:.4g}", f"{high - 1.0:.4g}")
    assert with_interval(2.0, 1.0, 3.7, bound_marks(NORTON, replace(cut, high=high - 1.0)))[1].startswith(
        "1.0 (search bound) to 3.7"
    )


@pytest.mark.parametrize(
    ("value", "half", "digits"), [(2.09e-6, 1e-9, 5), (3.32, 0.05, 3), (3.32, 2.0, 3), (1.0, 1e-12, 7), (0.0, 1.0, 3)]
)
def test_ends_of_an_interval_differ_from_its_value_as_printed(value: float, half: float, digits: int) -> None:
    assert interval_digits(value, value - half, value + half) == digits
    if half > 1e-6 * abs(value):
        assert f"{value:.{digits}g}" != f"{value + half:.{digits}g}"


def test_what_an_interval_does_not_include_adds_in_quadrature() -> None:
    effects = [UnmodelledEffect("load", 1.0, "%", -0.04, common=True), UnmodelledEffect("thickness", 0.01, "mm", 0.03)]
    assert combined_change_text(effects) == "5 %"
    assert combined_change_text([replace(effects[0], rate_change=0.7)]) == "a factor of 2"
    assert combined_change_text([]) == ""


# ---- exponents ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "said"), [("strain-hardening", False), ("time-hardening", True)])
def test_only_where_more_than_strain_is_held_another_exponent_is_spoken_of(
    name: str, said: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bars of strain hardening at one strain have the exponent of the formula, those of time hardening n / (1 + m)."""
    times = np.geomspace(360.0, 3.6e5, 30)
    tests = [
        ck.History(f"{s:g}", times, {"strain": 1e-13 * s**4 * times**0.6}, ck.constant_stress(s, "stress"), 1000.0)
        for s in (40.0, 60.0, 90.0)
    ]
    monkeypatch.setattr(stress_exponents, "_state", lambda fit: None)
    (text,) = reference_sentences(ck.identify(name, tests, starts=1))
    assert ("another exponent" in text) is said


# ---- forecasts ------------------------------------------------------------------------------------------------------


def test_a_time_is_stated_by_its_median_and_with_the_probability_of_what_was_asked() -> None:
    one = TimeForecast("strain 0.01", 376.0 * 3600, 310.0 * 3600, 115.0 * 3600, 513.0 * 3600, 0.47)
    assert _time_text(one, 300.0 * 3600) == (
        "strain 0.01: median 310 [115, 513] h; before the end of the test at 300 h with probability 0.47"
    )


def test_a_forecast_marks_the_median_that_its_table_states() -> None:
    """Not the time at the identified values, 376 h, which may lie far from it."""
    one = TimeForecast("strain 0.01", 376.0 * 3600, 310.0 * 3600, 115.0 * 3600, 513.0 * 3600, 0.47)
    rupture = SimpleNamespace(
        output="", target=0.0, value=one.value, median=one.median, low=one.low, high=one.high,
        measured=math.nan, censored=False,
    )  # fmt: skip
    axes = empty_figure(4.0, 3.0).add_subplot()
    axes.set_xlim(0.0, 600.0)
    _draw_times(axes, SimpleNamespace(times=[rupture]), SimpleNamespace(output="strain"), 1e-3, 1.0)
    (mark,) = [line for line in axes.lines if line.get_marker() == "|"]
    assert list(mark.get_xdata()) == [310.0]


def test_the_terminal_and_the_report_state_one_chi_square_of_a_test() -> None:
    """Norton bars at a held strain: 1/s^(n-1) grows by (n-1) E A t; one relaxes faster than the law says."""
    times = np.geomspace(36.0, 3.6e5, 30)
    tests = []
    for k, (strain, factor) in enumerate(((0.001, 1.0), (0.0012, 1.0), (0.0014, 1.4), (0.0016, 0.8))):
        noise = 0.3 * np.random.default_rng(k).normal(size=times.size)
        stress = ((1.5e5 * strain) ** -4.0 + 4.0 * 1.5e5 * factor * 1e-18 * times) ** -0.25 + noise
        held = ck.constant_strain(strain)
        elastic = ck.Elastic(1.5e5, 0.3)
        tests.append(
            ck.History(
                f"bar {k}", times, {"stress": stress}, held, 1000.0, "relaxation", elastic=elastic,
                standard_deviation={"stress": np.full(times.size, 0.3)},
            )
        )  # fmt: skip
    fit = ck.identify("norton", tests, starts=1)
    readings = judged_readings(fit)
    assert readings is not None
    rows = [line.split() for line in str(fit).splitlines() if line.startswith("  bar ")]
    # name in two words, condition in four ("727 °C, strain 0.001"), error, chi2
    assert [float(row[7]) for row in rows] == [
        pytest.approx(readings.chi_square(k), rel=6e-3) for k in range(len(tests))
    ]
    assert fit.tests[2].outputs[0].errors.chi_square > 2.0 * readings.chi_square(2)
