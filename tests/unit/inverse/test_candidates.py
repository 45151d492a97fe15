"""Which laws suit tests: by curves of known shape."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import FitError
from creepkit.inverse.candidates import candidates

HOUR = 3600.0


def bar(stress, shape, ends_by_rupture=False):
    x = np.linspace(0.0, 1.0, 41)[1:]
    strain = 0.02 * shape(x) + 2e-6 * np.random.default_rng(int(stress)).standard_normal(40)
    end = {"rupture_time": 1000 * HOUR} if ends_by_rupture else {}
    return ck.History(f"b{stress}", 1000 * HOUR * x, {"strain": strain}, ck.constant_stress(stress), 900.0, **end)


def names(tests):
    return [law.name for law in candidates(tests)]


def primary(x):
    return 0.4 * (1.0 - np.exp(-12.0 * x)) + 0.6 * x


def tertiary(x):
    return np.log(1.0 - 0.98 * x) / np.log(0.02)


def test_curves_whose_rate_falls_ask_for_primary_creep_and_several_stresses_for_an_exponent_that_changes():
    assert names([bar(100.0, primary), bar(110.0, primary)]) == ["norton*primary", "strain-hardening", "time-hardening"]
    several = names([bar(s, primary) for s in (80.0, 120.0, 160.0)])
    assert several[:2] == ["norton*primary", "hyperbolic-sine*primary"]


def test_steady_curves_and_curves_to_rupture():
    assert names([bar(100.0, lambda x: x)]) == ["norton", "strain-hardening", "time-hardening"]
    found = names([bar(s, tertiary, ends_by_rupture=True) for s in (80.0, 120.0, 160.0)])
    assert found == ["norton", "mpc-omega", "kachanov-rabotnov", "sinh-damage"]


def test_tables_of_rates_and_lives():
    rows = [
        ck.History(f"r{s}", np.array([t]), {}, ck.constant_stress(s), 900.0, minimum_rate=1e-3 / t, rupture_time=t)
        for s, t in ((80.0, 9e6), (100.0, 3e6), (120.0, 1e6), (150.0, 3e5), (180.0, 1e5))
    ]
    assert names(rows) == ["norton", "hyperbolic-sine", "kachanov-rabotnov", "sinh-damage"]


def test_a_name_with_primary_creep_is_the_law_itself_with_the_factor():
    law = ck.law("hyperbolic-sine*primary")
    assert law.fingerprint == ck.law("hyperbolic-sine").with_primary().fingerprint
    values = {"A": 1e-9, "B": 60.0, "n": 4.0, "b": 10.0, "e_p": 0.002}
    times = np.linspace(0.0, 1000 * HOUR, 11)[1:]
    run = ck.simulate(law, "uniaxial", values, times=times, loading=ck.constant_stress(90.0, control="stress"))
    rate = 1e-9 * np.sinh(1.5) ** 4
    exact = 0.002 * np.log(11.0 * np.exp(rate * times / 0.002) - 10.0)  # the closed form of its curve
    assert run.outputs["strain"] == pytest.approx(exact, rel=3e-6)


def test_tests_without_anything_to_identify_from_are_refused():
    ends = [ck.History("e", np.array([1e5]), {}, ck.constant_stress(100.0), 900.0, rupture_time=1e5)]
    with pytest.raises(FitError, match="curve or a minimum creep rate"):
        candidates(ends)
