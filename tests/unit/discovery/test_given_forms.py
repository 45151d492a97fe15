"""Forms that a user gives: expressions, functions, libraries and optimizers of pysindy, and the linear system."""

import numpy as np
import pysindy
import pytest
import sympy

import creepkit as ck
from creepkit.discovery.combinations import rank_combinations
from creepkit.discovery.forms import candidate_forms, evaluate_forms, law_with_forms
from creepkit.discovery.regression import regress, whitened_system
from creepkit.errors import FitError
from creepkit.kernels import lower
from creepkit.language import TemperatureForm
from creepkit.laws.norton import NORTON
from helpers.temperature_estimates import NINE, T_REF, arrhenius_line, conditioned, points

T = ck.temperature
Q, LN_A, N, SLOPE = 4.2e5, -35.0, 4.5, 6e-5
BENT = np.stack([arrhenius_line(NINE, LN_A, Q), N + SLOPE * (NINE - T_REF) ** 2], axis=1)
SHARP = conditioned(0.02, 0.01)


def candidates(n_forms, a_forms=("arrhenius",)):
    return {
        "A": candidate_forms(NORTON, "A", True, T_REF, NINE, a_forms),
        "n": candidate_forms(NORTON, "n", False, T_REF, NINE, n_forms),
    }


@pytest.mark.parametrize(
    "form",
    [
        (T - T_REF) ** 2,
        sympy.Symbol("n") + sympy.Symbol("bend") * (T - T_REF) ** 2,
        lambda temperature: (temperature - T_REF) ** 2,
        lambda temperature: np.cosh((temperature - T_REF) * 1e-5) * 1e10,
        lambda T_ref: TemperatureForm("square", _square, "planted", T_ref),
    ],
    ids=["function of T", "expression", "callable", "numpy", "form of T_ref"],
)
def test_a_planted_bend_is_found_by_a_form_that_a_user_gives(form):
    found = rank_combinations(points(BENT, SHARP, seed=1), candidates(["constant", "linear", form]))
    given = found.best.forms["n"]
    assert given not in ("constant", "linear")
    assert found.combinations[0].weight > 0.99
    curve = evaluate_forms(found.best.candidate_forms, found.best.values, NINE)[:, 1]
    assert curve == pytest.approx(BENT[:, 1], abs=0.05)


def _square(symbol, param):
    bend = sympy.Symbol(f"{symbol.name}_2", real=True)
    return symbol + bend * (T - T_REF) ** 2, {bend: ck.Param("bend", bounds=(-1e-2, 1e-2))}


def test_the_law_of_an_expression_is_the_expression():
    """ln A = a + c [1/T - 1/T_ref] on the log scale is Arrhenius with Q = -R c."""
    (form,) = candidate_forms(NORTON, "A", True, T_REF, NINE, [1 / T])
    assert form.name == "1/T"
    law = law_with_forms(NORTON, [form])
    values = {"A": np.exp(LN_A), "A_1": -Q / 8.314462618, "n": N}
    for now in (980.0, 1060.0):
        rate = float(lower(law, "numpy").rate(values, stress=90.0, temperature=now))
        expected = np.exp(arrhenius_line(np.array([now]), LN_A, Q))[0] * 90.0**N
        assert rate == pytest.approx(expected, rel=1e-9)


def test_an_optimizer_drops_the_terms_that_are_not_there():
    """A parabola about T_ref has no slope there; the others of the polynomial are zero but for noise."""
    form = [(T - T_REF) / 100, ((T - T_REF) / 100) ** 2, ((T - T_REF) / 100) ** 3]
    expression = sympy.Symbol("n") + sum(sympy.Symbol(f"c{k}") * one for k, one in enumerate(form))
    own = candidates([expression])
    given = points(BENT, SHARP, seed=3)
    found = rank_combinations(given, own, optimizer=pysindy.STLSQ(threshold=4.0, alpha=0.0))
    assert set(found.best.values) == {"A", "Q", "n", "c1"}
    k = list(found.best.values).index("c1")
    sd = np.sqrt(found.best.covariance[k, k])
    assert found.best.values["c1"] == pytest.approx(SLOPE * 1e4, abs=3 * sd)
    assert sd < 0.05
    assert not found.law.uses(sympy.Symbol("c0", real=True))
    every = rank_combinations(given, own)
    assert set(every.best.values) == {"A", "Q", "n", "c0", "c1", "c2"}
    assert every.best.chi_square < found.best.chi_square


def test_the_system_is_that_of_the_regression():
    """Least squares on the public arrays, by numpy alone, gives the planted numbers and the chi-square of regress()."""
    given, own = points(BENT, SHARP, seed=5), candidates(["constant", (T - T_REF) ** 2])
    system = whitened_system(given, own)
    assert system.X.shape == (18, 4)
    assert system.rows[:2] == (("A", 973.15), ("n", 973.15))
    whitener = np.linalg.inv(np.linalg.cholesky(system.covariance))
    assert whitener @ given.theta.ravel() == pytest.approx(system.y, rel=1e-9)
    found = regress(given, [forms[-1] for forms in own.values()])
    scale = np.linalg.norm(system.X, axis=0)
    numbers, chi_square, *_ = np.linalg.lstsq(system.X / scale, system.y, rcond=None)
    assert list(found.values.values()) == pytest.approx(numbers / scale, rel=1e-6)
    assert found.chi_square == pytest.approx(float(chi_square[0]), rel=1e-6)


def test_what_is_no_form_is_said_in_one_sentence():
    with pytest.raises(FitError, match="7 is no form: give a name, a sympy expression in ck.temperature"):
        candidates([7])
    with pytest.raises(FitError, match="cannot be written as an expression .* use arithmetic and exp, log"):
        candidates([lambda temperature: np.floor(temperature)])
    with pytest.raises(FitError, match="'T0' is no coefficient of a function of temperature, so that it needs bounds"):
        candidates([sympy.exp(-sympy.Symbol("T0") / T)])
