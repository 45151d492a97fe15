"""Rupture times of tables and laws that have no mechanism for them, on planted tables whose rates and lives differ."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import FitError
from creepkit.inverse.compared_tests import common_rupture_times, compared_tests, has_tertiary_creep
from creepkit.inverse.settings import IdentificationSettings
from creepkit.laws.norton import NORTON
from creepkit.records import History, constant_stress
from helpers.literature_laws import EQUATIONS
from helpers.rate_tables import GAS_CONSTANT, KACHANOV_VALUES, whole_life_table

KACHANOV = EQUATIONS["Kachanov-Rabotnov"]
REFERENCE = 873.15


def damaged_table(seed, exponent, energy, product, power, scatter):
    """18 tests by closed forms: rate a power law, life product / rate^power (h), lives alone of every fifth test."""
    rng, tests = np.random.default_rng(seed), []
    for T, stresses in ((823.15, (200, 220, 240, 260, 280, 300)), (873.15, (110, 125, 140, 160, 180, 200)),
                        (923.15, (60, 70, 80, 95, 110, 125))):  # fmt: skip
        for stress in stresses:
            factor = np.exp(-energy / GAS_CONSTANT * (1.0 / T - 1.0 / REFERENCE))
            rate = 1e-5 * (stress / 150.0) ** exponent * factor * np.exp(scatter * rng.standard_normal())
            life = 3600.0 * product / rate**power * np.exp(scatter * rng.standard_normal())
            known = {} if len(tests) % 5 == 4 else {"minimum_rate": float(rate / 3600.0)}
            loading = constant_stress(float(stress), "load")
            tests.append(History(f"T{len(tests)}", np.array([life]), {}, loading, T, rupture_time=float(life), **known))
    return tests


def test_which_laws_have_tertiary_creep():
    """By their formulas: rates that are constant or only fall, and those of damage, of exp(strain) and exp(time)."""
    steady = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine", "combined")
    assert not any(has_tertiary_creep(ck.law(name)) for name in steady)
    assert not has_tertiary_creep(NORTON.times(ck.arrhenius(T_ref=900.0)))
    assert all(has_tertiary_creep(EQUATIONS[name]) for name in ("Kachanov-Rabotnov", "MPC Omega"))
    assert has_tertiary_creep(ck.law("norton") + KACHANOV)
    assert has_tertiary_creep(ck.law("strain-hardening").with_bounds(m=(-0.5, 0.5)))


def test_rates_hold_the_truth_whatever_the_lives_are():
    """At a constant load a power law breaks after 1 / (n rate); these break up to ten times before, or after."""
    law, held = NORTON.with_bounds(n=(1.0, 15.0)).times(ck.arrhenius(T_ref=REFERENCE)), np.zeros(3)
    cases = np.array([(6.5, 430e3, 0.06, 0.9, 0.12), (4.0, 300e3, 0.02, 1.0, 0.3), (8.5, 550e3, 0.15, 0.85, 0.05)])
    for seed, (exponent, energy, product, power, scatter) in enumerate([*cases, cases[0]]):
        fit = ck.identify(law, damaged_table(seed, exponent, energy, product, power, scatter), starts=1)
        values = {e.name: e for e in fit.estimates}
        _, low, high = fit.rate(150.0, REFERENCE)
        held += [
            values["n"].low <= exponent <= values["n"].high,
            values["Q"].low <= energy <= values["Q"].high,
            low <= 1e-5 / 3600.0 <= high,
        ]
        assert not fit.adequacy.rejects
        assert "the ends of 18 tests without curves (rupture times and run-outs) were not used" in fit.notes[0]
        assert "left out, for they state nothing else: 'T4', 'T9', 'T14'" in fit.notes[0]
    assert (held >= 3).all()


def test_rates_and_lives_that_contradict_one_another_reject_a_law():
    law = NORTON.times(ck.arrhenius(T_ref=REFERENCE))
    fit = ck.identify(law, damaged_table(0, 6.5, 430e3, 0.06, 0.9, 0.12), starts=1, rupture_times="use")
    assert fit.adequacy.rejects
    assert fit.adequacy.contradicting.p_value < 1e-6
    assert "contradict one another by this law: predicted over measured is" in fit.details()
    assert "minimum rates and rupture times contradict one another" in fit.details().splitlines()[1]


def test_laws_are_compared_from_the_same_values():
    """Norton's law is rejected beside damage by lives of its tests, and alone identified from rates."""
    tests = whole_life_table(np.random.default_rng(2))
    ranking = ck.select([NORTON, KACHANOV.fix(r=KACHANOV_VALUES["r"])], tests, starts=1, sums=False)
    best, other = (ranked.fit for ranked in ranking.laws)
    assert best.law.name.startswith(KACHANOV.name)
    assert not best.adequacy.rejects
    for e in best.estimates:
        assert e.low <= KACHANOV_VALUES[e.name] <= e.high
    assert other.settings.rupture_times == "use"
    with pytest.raises(FitError, match="rupture_times='use' or 'ignore' for all laws"):
        ck.rank([ck.identify(NORTON, tests, starts=1), best])


def test_what_says_nothing_is_left_out_and_ends_alone_are_refused():
    settings, tests = IdentificationSettings(), damaged_table(0, 5.0, 4e5, 0.06, 0.9, 0.1)
    silent = [h.replace(rupture_time=None, unruptured=False) for h in tests]
    compared, notes = compared_tests(NORTON, silent, settings)
    assert len(compared) == 15
    assert notes[0].endswith("'T4', 'T9', 'T14'")
    ends = [h.replace(minimum_rate=None) for h in tests]
    with pytest.raises(FitError, match="breaks by loss of section alone, and these tests state nothing but their ends"):
        compared_tests(NORTON, ends, settings)
    assert len(compared_tests(KACHANOV, ends, settings)[0]) == len(ends)
    assert common_rupture_times([NORTON, KACHANOV], settings).rupture_times == "use"
    assert common_rupture_times([NORTON], settings) == settings
    with pytest.raises(FitError, match="rupture_times 'never' is not known"):
        IdentificationSettings(rupture_times="never")
