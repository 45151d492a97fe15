"""What a rig held, the load or the true stress, told apart by the shape of curves."""

import numpy as np
import pytest

import creepkit as ck

RATE, N, NOISE = 2e-9, 4.2, 2e-5
STRESSES = (100.0, 125.0, 150.0, 180.0)


def strain(stress, times, held):
    """Creep strain of a rate A s^n in closed form: r t under a true stress, -ln(1 - n r t) / n under a load."""
    grown = RATE * (stress / 100.0) ** N * times
    return grown if held == "stress" else -np.log1p(-N * grown) / N


def bars(held, stated, seed=3):
    """Bars under what was held, which state something else or the same."""
    rng, tests = np.random.default_rng(seed), []
    for stress in STRESSES:
        times = np.linspace(0.0, 0.12 / (RATE * (stress / 100.0) ** N), 61)[1:]
        noise = NOISE * rng.standard_normal(times.size)
        outputs, loading = {"strain": strain(stress, times, held) + noise}, ck.constant_stress(stress, stated)
        tests.append(ck.History(f"{stress:g} MPa", times, outputs, loading, 873.15))
    return tests


@pytest.mark.parametrize(("held", "stated"), [("stress", "load"), ("load", "stress")])
def test_what_was_held_is_a_remedy_where_it_explains_the_curves(held, stated):
    fit = ck.identify("norton", bars(held, stated))
    assert fit.adequacy.rejects
    assert f"(control = {held})" in fit.adequacy.remedies[0].description
    assert f"(control = {held})" in str(fit)
    assert ck.select(["norton"], bars(held, stated)).further == ()  # no richer law, whose exponents mimic it


@pytest.mark.parametrize("held", ["stress", "load"])
def test_what_is_stated_rightly_has_no_remedy(held):
    fit = ck.identify("norton", bars(held, held))
    assert (fit.adequacy.explains, fit.adequacy.remedies) == (True, ())
    assert fit.values["n"] == pytest.approx(N, abs=0.02)


def test_an_exponent_that_the_bend_of_curves_sets_leaves_the_rates_behind():
    """Strain 0.018 (s / 140 MPa)^4.8 (t / 4000 h)^0.4 of a true stress, stated as a load, to 0.4 % of itself."""
    rng, times, tests = np.random.default_rng(1), np.geomspace(1e5, 1.44e7, 30), []
    for stress in (100.0, 110.0, 120.0, 130.0, 140.0):
        values = 0.018 * (stress / 140.0) ** 4.8 * (times / 1.44e7) ** 0.4 * np.exp(0.004 * rng.normal(size=30))
        tests.append(ck.History(f"{stress:g}", times, {"strain": values}, ck.constant_stress(stress, "load"), 873.15))
    assert "(control = stress)" in ck.identify("time-hardening", tests).adequacy.remedies[0].description
