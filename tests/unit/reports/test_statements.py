"""Sentences and cells that state what the tests say: their numbers against rankings, bounds and closed forms."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import sympy

import creepkit as ck
from creepkit.exporters.documents import equations_in_latex, law_equations
from creepkit.inverse.identify import identify
from creepkit.inverse.perturbation import Perturbation, combined_change_text
from creepkit.inverse.selection.discrimination import chi_square_by_test
from creepkit.inverse.selection.ranking import Ranking, rank
from creepkit.inverse.settings import IdentificationSettings
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.reports.answer import cautions, interval_digits
from creepkit.reports.blocks import number
from creepkit.reports.judged_readings import judged_readings
from creepkit.reports.ranking import separating_test
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


def test_a_law_that_the_search_holds_says_so_first() -> None:
    """An exponent of 9.5, of a search that ends at 8; one that goes on to 16 finds it and says nothing."""
    tests = planted(NORTON, {"A": 1e-26, "n": 9.5}, [(s, 1000.0) for s in (60.0, 80.0, 120.0)], seed=2, noise=3e-4)
    held = identify(NORTON, tests, Steady(), settings=SETTINGS)
    assert cautions(held)[0] == "norton is held at n = 8, where its search ends; write bounds = { n = [1, 16] }"
    wide = NORTON.with_bounds(A=(1e-40, 1e-5), n=(1.0, 16.0))
    found = identify(wide, tests, Steady(), settings=SETTINGS)
    assert found.values["n"] == pytest.approx(9.5, rel=0.02)
    assert not any("held" in one for one in cautions(found))


# ---- what separates two laws ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("weights", ["likelihood", "noise"])
def test_what_separates_two_laws_is_stated_by_the_number_of_the_ranking(weights: str) -> None:
    found = ranking(weights, wide=True)
    (text,) = separating_test(found)
    assert text.endswith(f"is {number(found.laws[1].excess, 3)} larger in all")
    share = float(re.findall(r"(\d+) % of the chi-square", text)[0])
    assert 25.0 <= share <= 100.0  # the largest of four


@pytest.mark.parametrize("weights", ["likelihood", "noise"])
def test_nothing_separates_laws_that_predict_the_same(weights: str) -> None:
    assert separating_test(ranking(weights, wide=False)) == []


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


@pytest.mark.parametrize(
    ("value", "half", "digits"), [(2.09e-6, 1e-9, 5), (3.32, 0.05, 3), (3.32, 2.0, 3), (1.0, 1e-12, 7), (0.0, 1.0, 3)]
)
def test_ends_of_an_interval_differ_from_its_value_as_printed(value: float, half: float, digits: int) -> None:
    assert interval_digits(value, value - half, value + half) == digits
    if half > 1e-6 * abs(value):
        assert f"{value:.{digits}g}" != f"{value + half:.{digits}g}"


def test_what_an_interval_does_not_include_adds_in_quadrature() -> None:
    effects = [Perturbation("load", 1.0, "%", -0.04, common=True), Perturbation("thickness", 0.01, "mm", 0.03)]
    assert combined_change_text(effects) == "5 %"
    assert combined_change_text([replace(effects[0], rate_change=0.7)]) == "a factor of 2"
    assert combined_change_text([]) == ""


# ---- equations ------------------------------------------------------------------------------------------------------


def test_a_law_has_one_form_in_mathml_and_latex() -> None:
    """exp(-c s) is a factor in both, and no denominator in one of them."""
    A, c = ck.parameters("A c")
    rate = A * sympy.exp(ck.strain * sympy.exp(-c * ck.stress))
    params = {A: ck.Param("a", (1e-9, 1.0), "1/s", "log"), c: ck.Param("b", (0, 1), "1/MPa")}
    law = ck.CreepLaw(name="x", terms={"x": rate}, params=params)
    (mathml,) = law_equations(law)
    assert "<mfrac>" not in mathml
    assert mathml.count("<mi>exp</mi>") == "\n".join(equations_in_latex(law)).count(r"\exp") == 2


# ---- chi-square of a test --------------------------------------------------------------------------------------------


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
    rows = [line.split() for line in fit.details().splitlines() if line.startswith("  bar ")]
    # name in two words, condition in four ("727 °C, strain 0.001"), error, chi2
    assert [float(row[7]) for row in rows] == [
        pytest.approx(readings.chi_square(k), rel=6e-3) for k in range(len(tests))
    ]
    assert fit.tests[2].outputs[0].errors.chi_square > 2.0 * readings.chi_square(2)
