"""Values beyond the bounds that a law begins with are found; bounds that a user states are kept."""

import pytest

import creepkit as ck
from creepkit.inverse.bounds import widened
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
    kept = identify(NORTON.with_bounds(n=(1, 8), A=(1e-40, 1e-5)), tests, BAR, settings=QUICK)
    assert kept.values["n"] < 8.0 + 1e-6
    assert kept.law.table["n"].bounds == (1.0, 8.0)
    assert kept.adequacy.rejects


def test_only_the_larger_end_of_an_exponent_widens():
    ends = {"low": NORTON.to_internal({"A": 1e-12, "n": 1.0}), "high": NORTON.to_internal({"A": 1e-5, "n": 8.0})}
    assert widened(NORTON, ends["low"][0]) is None
    assert widened(NORTON, ends["high"][0]).table["n"].bounds == (1.0, pytest.approx(32 / 3))
    assert widened(NORTON, ends["high"][0]).table["A"].bounds == pytest.approx((1e-40, 1e-3))
