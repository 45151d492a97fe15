"""Values beyond the bounds that a law begins with are found; bounds that a user states are kept."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.identify import identify, refit
from creepkit.inverse.reference_conditions import ReferencePoint
from creepkit.inverse.settings import IdentificationSettings
from creepkit.records import constant_stress
from helpers.planted_bars import BAR, bars
from helpers.registered_laws import registered_laws

NORTON, QUICK = ck.law("norton"), IdentificationSettings(starts=2, sobol_points=16)
SOLDER = {"A": 1e-3, "n": 11.0}, (0.3, 0.35, 0.4, 0.45)
P91 = {"A": 2e-34, "n": 13.0}, (90.0, 100.0, 110.0, 120.0)


@pytest.mark.parametrize(("truth", "stresses"), [SOLDER, P91], ids=["solder", "P91"])
def test_a_search_goes_on_beyond_bounds_that_nobody_stated(truth, stresses):
    tests = bars(NORTON, truth, [constant_stress(s) for s in stresses], seed=3)
    fit = identify(NORTON, tests, BAR, settings=QUICK)
    assert all(e.low < truth[e.name] < e.high and e.verdict == "determined" for e in fit.estimates)
    assert any(note.startswith("n was searched from 1 to 14.2") for note in fit.notes)
    stated = NORTON.with_bounds(n=(1, 8), A=(1e-40, 1e-5))
    if truth is SOLDER[0]:  # five times the rates that any values within these bounds give
        with pytest.raises(FitError, match="the bounds exclude the data, which push A above them"):
            identify(stated, tests, BAR, settings=QUICK)
    else:
        assert identify(stated, tests, BAR, settings=QUICK).values["n"] < 8.0 + 1e-6


def stated_tests(stresses, rates, scatter, seed, duration):
    """Tests at 900 K by their minimum rates, with scatter between them."""
    rates = rates * np.exp(scatter * np.random.default_rng(seed).standard_normal(len(stresses)))
    return [
        ck.History(f"m{s:g}", np.array([duration]), {}, constant_stress(float(s)), 900.0, minimum_rate=float(rate))
        for s, rate in zip(stresses, rates, strict=True)
    ]


SOFT = {
    "hyperbolic-sine": ({"A": 6e-4, "n": 4.0, "B": 15.0}, lambda s: 6e-4 * np.sinh(s / 15.0) ** 4),
    "threshold-stress": ({"A": 2e-6, "n": 3.0, "s_0": 2.5}, lambda s: 2e-6 * (s - 2.5) ** 3),
}


@pytest.mark.parametrize("name", SOFT)
def test_a_law_is_not_excluded_by_its_own_bounds(name):
    """Of a soft metal: a coefficient beyond the usual ones, and a threshold at 1/200 of the range of thresholds."""
    (truth, rate), stresses = SOFT[name], np.geomspace(4.0, 60.0, 14)
    ranking = ck.select(["norton", name], stated_tests(stresses, rate(stresses), 0.08, 4, 1.0), starts=4)
    assert ranking.best.law.name == name
    assert all(e.low < truth[e.name] < e.high for e in ranking.best.estimates), ranking.best.estimates


def test_rate_coefficients_of_every_law_are_sought_beyond_their_bounds():
    for law in registered_laws().values():
        coordinates = Coordinates(law, ReferencePoint(100.0, 0.01, 1e6, 900.0))
        assert all(law.table[law.names[k]].widens for k in coordinates.coefficients), law.name


def minimum_rates(n, highest, seed):
    """Six minimum rates between 100 MPa and `highest` by a stress exponent n, with 15 % of scatter; their slope."""
    stresses = np.geomspace(100.0, highest, 6)
    tests = stated_tests(stresses, 1e-9 * (stresses / 100.0) ** n, 0.15, seed, 1e6)
    return tests, np.polyfit(np.log(stresses), np.log([test.minimum_rate for test in tests]), 1)[0]


@pytest.mark.parametrize("seed", [2, 5])
def test_bounds_stay_where_the_tests_say_less_than_they_do(seed):
    """Stresses within 4 % give slopes of 11 and 13 for a planted 6: 40 times the rate at twice the stress, or more."""
    tests, slope = minimum_rates(6.0, 104.0, seed)
    assert slope > 11.0
    fit = ck.identify(NORTON, tests)
    assert fit.values["n"] <= 8.0
    assert {e.name: e.verdict for e in fit.estimates}["n"] == "not determined"
    assert abs(np.log(fit.rate(200.0, warn=False)[0] / (1e-9 * 2.0**6))) < np.log(5.0)


@pytest.mark.parametrize(("n", "seed"), [(9.0, 1), (9.0, 2), (12.0, 2), (12.0, 6)])
def test_a_value_within_two_or_three_of_an_exponent_is_found_beyond_bounds(n, seed):
    tests, slope = minimum_rates(n, 125.0, seed)
    assert ck.identify(NORTON, tests).values["n"] == pytest.approx(slope, abs=0.02)


def test_a_refit_keeps_the_bounds_of_its_fit():
    """Held-out tests are predicted by the law that was identified, in the bounds that are printed with it."""
    inside, (beyond, slope) = minimum_rates(6.0, 125.0, seed=0)[0], minimum_rates(12.0, 125.0, seed=0)
    assert refit(ck.identify(NORTON, inside), beyond).values["n"] <= 8.0
    assert refit(ck.identify(NORTON, beyond), beyond).values["n"] == pytest.approx(slope, abs=0.02)


def test_values_at_a_bound_and_rates_are_of_one_point(tmp_path):
    """Rates over a threshold stress, and of an exponential law, hold the exponent of a sine at either of its bounds.

    There the rates miss the planted ones by no more in their squares than the best of all B, but for the noise.
    """
    stresses = np.geomspace(50.0, 130.0, 9)
    shapes = {"above a threshold": 1e-15 * (stresses - 44.0) ** 4.0, "exponential": 1e-12 * np.exp(stresses / 9.0)}
    wrong = {}
    for shape, rates in shapes.items():
        tests = stated_tests(stresses, rates, 0.08, 3, 1e6)
        fit = ck.identify("hyperbolic-sine", tests, weights="likelihood")
        formula = fit.values["A"] * np.sinh(stresses / fit.values["B"]) ** fit.values["n"]
        loaded = ck.load(fit.save(tmp_path / "fit.json"))
        stated = [one.rate(stresses, warn=False)[0] for one in (fit, loaded)]
        held = min(abs(fit.values["n"] - 1.0), abs(fit.values["n"] - 8.0)) < 0.02
        sines = round(fit.values["n"]) * np.log(np.sinh(stresses / np.geomspace(3.0, 1000.0, 4000)[:, None]))
        least = 9 * np.var(sines - np.log(rates), axis=1).min()
        near = 9 * np.var(np.log(stated[0] / rates)) < least + 9 * 0.08**2
        if not (held and near and np.allclose(stated, formula, rtol=1e-9)):
            wrong[shape] = (fit.values, stated[0] / formula, stated[0] / rates)
    assert not wrong
