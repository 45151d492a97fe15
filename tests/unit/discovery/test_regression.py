"""Forms through points: against closed forms, scipy, and what was planted."""

import numpy as np
import pytest

from creepkit import registry
from creepkit.discovery.combinations import CHI_SQUARE_95, rank_combinations, squared_mahalanobis
from creepkit.discovery.forms import candidate_forms, evaluate_forms
from creepkit.discovery.regression import regress
from creepkit.inverse.uncertainty.mixture_distribution import MixtureDistribution
from creepkit.laws.drifting_exponent import DRIFTING_EXPONENT
from creepkit.laws.norton import NORTON
from helpers.temperature_estimates import NINE, T_REF, arrhenius_line, conditioned, points

Q, LN_A, N, SLOPE = 4.2e5, -35.0, 4.5, -8e-3
PLANTED = np.stack([arrhenius_line(NINE, LN_A, Q), N + SLOPE * (NINE - T_REF)], axis=1)
FEW = {"A": ("constant", "arrhenius", "logarithmic"), "n": ("constant", "linear", "inverse", "t-log-t")}


def library(parameter, form, T=NINE, law=NORTON):
    found = candidate_forms(law, parameter, parameter == "A", T_REF, T, ("constant", form))
    return next(one for one in found if one.name == form)


def libraries(forms=FEW):
    return {p: candidate_forms(NORTON, p, p == "A", T_REF, NINE, own) for p, own in forms.items()}


# ---- generalised least squares -------------------------------------------------------------------------------------


def test_the_mean_of_correlated_points_is_the_textbook_one():
    """Constant forms: theta = (sum C^-1)^-1 sum C^-1 theta_k, with that inverse as covariance."""
    T = np.array([1000.0, 1030.0, 1060.0])
    covariances = np.stack([conditioned(0.1 * k, 0.3 / k) for k in (1, 2, 3)])
    given = points(np.array([[-35.0, 4.0], [-34.0, 4.4], [-36.0, 4.1]]), covariances, T)
    found = regress(given, [library("A", "constant"), library("n", "constant")])
    inverses = np.linalg.inv(covariances)
    total = np.linalg.inv(inverses.sum(axis=0))
    mean = total @ np.einsum("kij,kj->i", inverses, given.theta)
    assert np.allclose(list(found.values.values()), mean, rtol=1e-8)
    assert np.allclose(found.covariance, total, rtol=1e-6)
    off = given.theta - mean
    assert found.chi_square == pytest.approx(np.einsum("ki,kij,kj->", off, inverses, off), rel=1e-6)


def test_exact_points_give_back_what_was_planted():
    found = regress(points(PLANTED, conditioned(0.05, 0.1)), [library("A", "arrhenius"), library("n", "linear")])
    assert found.values == pytest.approx({"A": LN_A, "Q": Q, "n": N, "n_T": SLOPE}, rel=1e-7)
    assert found.chi_square < 1e-9


def test_correlation_tells_more_than_error_bars():
    """Q with whole covariances, where n is constant, is ten times better known than from ln A with its own errors."""
    theta = np.stack([arrhenius_line(NINE, LN_A, Q), np.full(NINE.size, N)], axis=1)
    whole = conditioned(0.05, 0.3)
    forms = [library("A", "arrhenius"), library("n", "constant")]
    sharp = regress(points(theta, whole), forms)
    blunt = regress(points(theta, np.diag(np.diag(whole))), forms)
    k = list(sharp.values).index("Q")
    spread = np.sum((1 / NINE - np.mean(1 / NINE)) ** 2)
    assert np.sqrt(sharp.covariance[k, k]) == pytest.approx(8.314462618 * 0.05 / np.sqrt(spread), rel=1e-3)
    assert np.sqrt(blunt.covariance[k, k]) > 10 * np.sqrt(sharp.covariance[k, k])


# ---- inside exponentials -------------------------------------------------------------------------------------------


def test_variable_projection_finds_what_is_inside_an_exponential():
    T, T0 = np.linspace(600.0, 1400.0, 17), 5000.0
    n = 2.0 + 60.0 * np.exp(-T0 / T)
    given = points(np.stack([np.full(T.size, LN_A), n], axis=1), conditioned(0.05, 0.01), T)
    found = regress(given, [library("A", "constant"), library("n", "boltzmann", T)])
    assert found.values["n_T0"] == pytest.approx(T0, rel=1e-4)
    slope = 60.0 * np.exp(-T0 / T_REF) * T0 / T_REF**2
    assert found.values["n_E"] == pytest.approx(slope, rel=1e-3)
    assert np.allclose(evaluate_forms(found.candidate_forms, found.values, T)[:, 1], n, atol=1e-5)


def test_an_activation_energy_of_a_linear_parameter_is_inside_an_exponential_too():
    tau = 5000.0 * np.exp(2e5 / 8.314462618 * (1 / NINE - 1 / T_REF))
    law = DRIFTING_EXPONENT.fix(m=0, n_0=3.0, n_inf=4.0, C=2.0, tau_r=2000.0)
    form = library("tau_d", "activated", law=law)
    assert [s.name for s in form.nonlinear_parameters] == ["Q_tau_d"]
    given = points(np.stack([np.full(9, LN_A), tau], axis=1), np.diag([0.01, 25.0]), law=law)
    constant = next(iter(candidate_forms(law, "A", True, T_REF, NINE, ("constant",))))
    found = regress(given, [constant, form])
    assert found.values["Q_tau_d"] == pytest.approx(-2e5, rel=1e-4)


# ---- which form ----------------------------------------------------------------------------------------------------


def test_planted_forms_remain_and_q_lies_in_its_interval():
    """Twenty draws: 95 % sets and intervals hold the truth in at least 16 (binomial: fewer with probability .3 %)."""
    kept, inside = 0, 0
    own = libraries({"A": ("arrhenius", "logarithmic"), "n": ("constant", "linear", "inverse")})
    for seed in range(20):
        given = points(PLANTED, conditioned(0.05, 0.15), seed=seed)
        found = rank_combinations(given, own)
        names = {p: [form.name for form in forms] for p, forms in found.plausible_forms.items()}
        kept += "arrhenius" in names["A"] and "linear" in names["n"]
        alike = [one for one in found.combinations if one.forms["A"] == "arrhenius"]
        weights = np.array([one.weight for one in alike])
        value = np.array([one.values["Q"] for one in alike])
        sd = np.array([np.sqrt(o.covariance[(k := list(o.values).index("Q")), k]) for o in alike])
        scale = sd * np.sqrt(found.overdispersion)
        _, low, high = MixtureDistribution(weights / weights.sum(), np.full(len(alike), 1e9), value, scale).interval()
        inside += low <= Q <= high
    assert kept >= 16
    assert inside >= 16


def test_forms_that_ten_per_cent_of_temperature_cannot_separate_are_equivalent():
    found = rank_combinations(points(PLANTED, conditioned(0.2, 0.3), seed=3), libraries())
    equivalent = {form.name for form in found.plausible_forms["n"] if form.equivalent}
    assert {"linear", "inverse", "t-log-t"} <= equivalent
    a, b = found.with_form("n", "linear"), found.with_form("n", "inverse")
    assert squared_mahalanobis(a, b, points(PLANTED, conditioned(0.2, 0.3)), 1.0) < CHI_SQUARE_95
    sharp = rank_combinations(points(PLANTED, conditioned(1e-3, 1e-3), seed=3), libraries())
    assert [form.name for form in sharp.plausible_forms["n"]] == ["linear"]
    assert [form.name for form in sharp.plausible_forms["A"]] == ["arrhenius"]


PLUGIN = """
from sympy import Symbol
from creepkit.language import Param, TemperatureForm, hookimpl, temperature

def square(T_ref=1000.0):
    def build(symbol, param):
        bend = Symbol(symbol.name + "_2", real=True)
        return symbol + bend * (temperature - T_ref) ** 2, {bend: Param("bend", bounds=(-1.0, 1.0))}
    return TemperatureForm("square", build, "a plugin", T_ref)

@hookimpl
def creepkit_temperature_forms():
    return {"square": square}
"""


def test_forms_of_plugins_are_candidates(own_registry, tmp_path):
    file = tmp_path / "square.py"
    file.write_text(PLUGIN)
    registry.default_registry().load_file(file)
    bent = np.stack([arrhenius_line(NINE, LN_A, Q), N + 2e-4 * (NINE - T_REF) ** 2], axis=1)
    own = {
        "A": candidate_forms(NORTON, "A", True, T_REF, NINE, FEW["A"]),
        "n": candidate_forms(NORTON, "n", False, T_REF, NINE),
    }
    found = rank_combinations(points(bent, conditioned(0.02, 0.02), seed=2), own)
    assert "square" in [form.name for form in found.plausible_forms["n"]]
    assert found.with_form("n", "square").values["n_2"] == pytest.approx(2e-4, rel=0.1)
