"""Sentences of the grammar are laws; what proposes them; and a law that was planted is found again."""

from itertools import pairwise, product

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import creepkit as ck
from creepkit.errors import FitError
from creepkit.law_search.grammar import HARDENING, SOFTENING, STRESS, Product, Sentence
from creepkit.law_search.law_file import write_law_file
from creepkit.law_search.proposals import proposed_products, proposed_sums
from creepkit.law_search.smoothed_rates import SmoothedRates
from creepkit.testing import check_law

ENERGY, R = 3e5, 8.314462618


@pytest.mark.parametrize(("stress", "hardening"), [*product(STRESS, HARDENING)])
def test_every_product_is_a_law_of_the_registrys_kind(stress: str, hardening: str) -> None:
    softening = SOFTENING[(list(STRESS).index(stress) + HARDENING.index(hardening)) % 2]
    report = check_law(Product(stress, hardening, softening).law, samples=16)
    assert report.passed, str(report)


def test_a_sentence_of_built_in_products_is_the_law_made_by_algebra() -> None:
    sentence = Sentence((Product("sinh"), Product("power", "strain power")), "arrhenius", 900.0)
    made = (ck.law("strain-hardening") + ck.law("hyperbolic-sine")).times(ck.arrhenius(900.0))
    assert sentence.law == made
    assert sentence.law.name == made.name


def test_an_exchange_of_a_factor_leads_back() -> None:
    sentence = Sentence((Product(), Product("sinh", "time power")), "arrhenius")
    exchanged = [one for one in sentence.neighbours() if len(one.products) == 2 and one.temperature == "arrhenius"]
    assert len(exchanged) == 2 * (4 + 4 + 1)
    assert all(sentence in one.neighbours() for one in exchanged)


@pytest.mark.parametrize("law", [Product("threshold", "time saturation", "strain").law, ck.law("kachanov-rabotnov")])
def test_a_law_file_holds_the_same_law(law: ck.CreepLaw, tmp_path) -> None:
    path = write_law_file(ck.law_with_values(law, law.center()), tmp_path / f"found_{len(law.states)}.py")
    ck.load_plugin(path)
    assert ck.law(f"found-{len(law.states)}") == law


def rates(log_rate) -> SmoothedRates:
    """Exact rates over four stresses, three temperatures and two decades of time."""
    grid = np.meshgrid([60.0, 80.0, 110.0, 150.0], [850.0, 900.0, 950.0], np.geomspace(1e3, 1e5, 8), indexing="ij")
    stress, temperature, time = (one.ravel() for one in grid)
    strain = 1e-3 * (time / 1e4) ** 0.4 * (stress / 80.0) ** 1.5
    return SmoothedRates(stress, strain, time, temperature, log_rate(stress, strain, time, temperature))


def test_sparse_regression_of_exact_rates_names_the_factors() -> None:
    exact = rates(lambda s, e, t, T: 5 * np.log(s) - 0.5 * np.log(t) - ENERGY / (R * T))
    assert Product("power", "time power") in proposed_products(exact)


def test_sparse_regression_of_exact_rates_names_the_summands() -> None:
    exact = rates(lambda s, e, t, T: np.log(1e-18 * s**5 + 1e-12 * s**3 * t**-0.5))
    parts = {Product(): 5 * np.log(exact.stress) + np.log(1e-18), Product("sinh"): 0 * exact.stress - 30.0}
    parts[Product("power", "time power")] = 3 * np.log(exact.stress) - 0.5 * np.log(exact.time) + np.log(1e-12)
    assert proposed_sums(exact, parts)[0] == (Product(), Product("power", "time power"))


def bar(stress: float, T: float, factor: float, rng: np.random.Generator) -> ck.History:
    """Norton's law with primary creep under a constant true stress."""
    steady = factor * 1e-8 * (stress / 80.0) ** 5 * np.exp(-ENERGY / R * (1 / T - 1 / 900.0))
    times = np.geomspace(0.01, 1.0, 30) * 0.03 / steady
    run = solve_ivp(
        lambda _, e: steady * (1 + 4 * np.exp(-e / 0.006)), (0, times[-1]), [0.0], "DOP853", times, rtol=1e-9
    )
    outputs = {"strain": run.y[0] + 2e-5 * rng.normal(size=times.size)}
    loading = ck.StressSteps([(0.0, stress)], control="stress")
    return ck.History(f"{T:g} K, {stress:g} MPa", times=times, outputs=outputs, loading=loading, temperature=T)


def test_a_planted_law_is_found_and_stands_on_the_front() -> None:
    rng = np.random.default_rng(0)
    tests = [
        bar(s, T, np.exp(0.03 * rng.normal()), rng) for s in (60.0, 80.0, 110.0, 150.0) for T in (850.0, 900.0, 950.0)
    ]
    search = ck.search_laws(tests, budget=8.0)
    assert "norton*primary*arrhenius" in [one.fit.law.name for one in search.ranking.laws[:3]]
    stress, strain = np.meshgrid([60.0, 80.0, 110.0, 150.0], np.geomspace(1e-3, 0.03, 9))
    found = ck.lower(search.best.law).rate(search.best.values, stress=stress, strain=strain, temperature=900.0)
    assert found == pytest.approx(1e-8 * (stress / 80.0) ** 5 * (1 + 4 * np.exp(-strain / 0.006)), rel=0.05)
    assert str(search).startswith(f"use {search.best.law.name} for")
    front = search.front
    assert all(a.complexity < b.complexity and a.misfit > b.misfit for a, b in pairwise(front))
    assert search.to_dataframe()["front"].sum() == len(front)
    assert search.plot().axes[0].get_ylabel() == "rms of ln strain"


def test_tests_without_curves_of_bars_are_refused() -> None:
    rate = ck.History(
        "minimum", np.array([3.6e6]), {}, minimum_rate=1e-8, temperature=900.0, loading=ck.constant_stress(80.0)
    )
    with pytest.raises(FitError, match="creep curves of bars"):
        ck.search_laws([rate])
