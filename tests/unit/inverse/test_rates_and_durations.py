"""Laws of hardening and minimum rates without curves: their shape rests on the stated durations alone."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.inverse.compared_tests import UNTESTABLE, rests_on_durations
from helpers.rupture_tests import BAR


def _table(rate_scatter: float = 0.05) -> list[ck.History]:
    """Rates of Norton's law with n = 4.6 and lives of Monkman and Grant, as a table states them."""
    rng = np.random.default_rng(4)
    tests = []
    for s in (60.0, 80.0, 100.0, 130.0, 160.0, 200.0):
        rate = 1e-8 * (s / 100) ** 4.6 * np.exp(rate_scatter * rng.standard_normal())
        tests.append(
            ck.History(
                f"{s:g} MPa", np.array([0.06 / rate]), {}, ck.constant_stress(s, "stress"), 1173.15,
                minimum_rate=rate, rupture_time=0.06 / rate,
            )
        )  # fmt: skip
    return tests


@pytest.mark.parametrize(
    ("name", "untestable"), [("norton", False), ("strain-hardening", True), ("time-hardening", True)]
)
def test_only_laws_of_hardening_rest_on_durations(name, untestable):
    assert rests_on_durations(ck.law(name), _table()) is untestable
    curve = ck.simulate(
        "norton", "uniaxial", {"A": 1e-18, "n": 5.0}, times=[0.0, 1e4], loading=ck.constant_stress(80.0)
    )
    assert not rests_on_durations(ck.law(name), [*_table(), curve])


def test_an_interval_that_excludes_the_planted_exponent_is_said_not_to_be_testable():
    """Durations are inverse to the rates, so that time hardening explains the same rates with another exponent."""
    fit = ck.identify(ck.law("time-hardening").fix(m=-0.3), _table(), using=BAR, starts=2)
    (n,) = (e for e in fit.estimates if e.name == "n")
    assert not n.low < 4.6 < n.high
    assert UNTESTABLE in fit.notes
    assert UNTESTABLE not in ck.identify("norton", _table(), using=BAR, starts=2).notes
