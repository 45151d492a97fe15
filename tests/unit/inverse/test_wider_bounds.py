"""Values beyond the bounds that a law begins with are found; bounds that a user states are kept."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import FitError
from creepkit.inverse.identify import identify
from creepkit.inverse.settings import IdentificationSettings
from creepkit.records import constant_stress
from helpers.planted_bars import BAR, bars

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


def test_values_at_a_bound_and_rates_are_of_one_point(tmp_path):
    """Rates over a threshold stress, and of an exponential law, hold the exponent of a sine at either of its bounds."""
    stresses = np.geomspace(50.0, 130.0, 9)
    shapes = {"above a threshold": 1e-15 * (stresses - 44.0) ** 4.0, "exponential": 1e-12 * np.exp(stresses / 9.0)}
    scatter = np.exp(0.08 * np.random.default_rng(3).standard_normal(9))
    wrong = {}
    for shape, rates in shapes.items():
        tests = [
            ck.History(f"m{s:.0f}", np.array([1e6]), {}, ck.constant_stress(s), 900.0, minimum_rate=rate)
            for s, rate in zip(stresses, rates * scatter, strict=True)
        ]
        fit = ck.identify("hyperbolic-sine", tests, weights="likelihood")
        formula = fit.values["A"] * np.sinh(stresses / fit.values["B"]) ** fit.values["n"]
        loaded = ck.load(fit.save(tmp_path / "fit.json"))
        stated = [one.rate(stresses, warn=False)[0] for one in (fit, loaded)]
        held = min(abs(fit.values["n"] - 1.0), abs(fit.values["n"] - 8.0)) < 0.02
        near = np.abs(np.log(stated[0] / rates)).max() < 2.0
        if not (held and near and np.allclose(stated, formula, rtol=1e-9)):
            wrong[shape] = (fit.values, stated[0] / formula, stated[0] / rates)
    assert not wrong
