"""Sentences of the grammar are laws; what proposes them; and a law that was planted is found again."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import creepkit as ck
from creepkit.errors import FitError
from creepkit.law_search.grammar import Product, Sentence
from creepkit.law_search.law_file import write_law_file
from creepkit.law_search.proposals import proposed_sums
from creepkit.law_search.smoothed_rates import SmoothedRates
from creepkit.testing import check_law

ENERGY, R = 3e5, 8.314462618
BACK_STRESS = Product("power", "back stress")
PLANTED = {"A": 1e-15, "n": 4.0, "H": 8e3, "r": 3e-6, "Q_r": 2.8e5, "D": 4e-16, "chi": 5.0, "Q_D": 3.2e5, "q": 0.5}
PLANTED |= {"Q": 3e5, "B": 60.0, "b": 4.0, "e_p": 0.005}


@pytest.mark.parametrize("one", [*Product.all()[::4], Product("power", "back stress", "damage")], ids=str)
def test_every_product_is_a_law_of_the_registrys_kind(one: Product) -> None:
    report = check_law(one.law, samples=16)
    assert report.passed, str(report)


def test_a_sentence_of_built_in_products_is_the_law_made_by_algebra() -> None:
    sentence = Sentence((Product("sinh"), Product("power", "strain power")), "arrhenius", 900.0)
    made = (ck.law("strain-hardening") + ck.law("hyperbolic-sine")).times(ck.arrhenius(900.0))
    assert sentence.law == made
    assert sentence.law.name == made.name


def test_an_exchange_of_a_factor_leads_back() -> None:
    sentence = Sentence((Product(), Product("sinh", "time power")), "arrhenius")
    exchanged = [one for one in sentence.neighbours() if len(one.products) == 2 and one.temperature == "arrhenius"]
    assert len(exchanged) == 2 * (4 + 4 + 2)  # a back stress stands in no sum
    assert all(sentence in one.neighbours() for one in exchanged)


@pytest.mark.parametrize("law", [Product("threshold", "time saturation", "strain").law, BACK_STRESS.law])
def test_a_law_file_holds_the_same_law(law: ck.CreepLaw, tmp_path) -> None:
    path = write_law_file(ck.law_with_values(law, law.center()), tmp_path / f"found_{len(law.states)}.py")
    ck.load_plugin(path)
    assert ck.law(f"found-{len(law.states)}") == law


def test_sparse_regression_of_exact_rates_names_the_summands() -> None:
    stress, time = (one.ravel() for one in np.meshgrid([60.0, 80.0, 110.0, 150.0], np.geomspace(1e3, 1e5, 8)))
    points, none = np.stack([stress] * 3, axis=1), np.zeros((32, 3))
    rate = np.log(1e-18 * stress**5 + 1e-12 * stress**3 * time**-0.5)
    exact = SmoothedRates(points, none, none, none[:, :1] + 900.0, none, rate, none[:, 0] + 0.01, none[:, 0])
    parts = {Product(): 5 * np.log(stress) + np.log(1e-18), Product("sinh"): 0 * stress - 30.0}
    parts[Product("power", "time power")] = 3 * np.log(stress) - 0.5 * np.log(time) + np.log(1e-12)
    assert proposed_sums(exact, parts)[0] == (Product(), Product("power", "time power"))


@pytest.mark.parametrize("one", [BACK_STRESS, Product("power", "none", "damage"), Product("sinh", "strain saturation")])
def test_rates_of_smoothed_curves_give_back_the_planted_values(one: Product) -> None:
    """Internal variables follow from measured strain and time; the curves are scipy's."""
    sentence = Sentence((one,), "arrhenius", 900.0)
    values = {name: PLANTED[name] for name in sentence.law.names} | ({"A": 1e-17} if one.hardening == "none" else {})
    values |= {"A": 1e-9, "n": 3.0} if one.stress == "sinh" else {}
    tests = [planted(sentence.law, values, s, T) for s in (60.0, 80.0, 110.0, 150.0) for T in (850.0, 900.0, 950.0)]
    fitted = SmoothedRates.of_tests(tests).fitted(sentence).values[one]
    logs = {name: sentence.law.params[sentence.law.symbol(name)].scale == "log" for name in values}
    found = {name: np.exp(value) if logs[name] else value for name, value in fitted.items()}
    assert found == {name: pytest.approx(value, rel=0.15 if logs[name] else 0.03) for name, value in values.items()}


def planted(law: ck.CreepLaw, values: dict[str, float], stress: float, T: float) -> ck.History:
    """A bar under constant true stress to 4 % or half of its life; the variable of integration is time^(1/5)."""
    kernel, states = ck.lower(law), [state.name for state in law.states]

    def slope(x: float, y: np.ndarray) -> np.ndarray:
        at = {"stress": stress, "strain": min(y[0], 0.1), "temperature": T, **dict(zip(states, y[1:], strict=True))}
        rates = [kernel.rate(values, **at), *kernel.state_rates(values, **at).values()]
        return 5 * x**4 * np.array([float(one) for one in rates])

    ends = [lambda x, y: y[0] - 0.04, lambda x, y: y[-1] - 0.9 if "v" in states else -1.0]
    for end in ends:
        end.terminal = True
    start, tight = [1e-12, *(0.0 for _ in states)], {"rtol": 1e-7, "atol": 1e-9}
    run = solve_ivp(slope, (1e-9, 1e7**0.2), start, "LSODA", events=ends, dense_output=True, **tight)
    times = np.geomspace(1e-3, 1.0, 60) * run.t[-1] ** 5
    loading = ck.StressSteps([(0.0, stress)], control="stress")
    return ck.History("bar", times=times, outputs={"strain": run.sol(times**0.2)[0]}, loading=loading, temperature=T)


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
    assert str(search).startswith(f"use {search.best.law.name} for ")
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
