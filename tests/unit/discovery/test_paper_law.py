"""The paper's own law, Eq. (1), over four temperatures: forms planted by quadrature are found among all forms."""

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

import creepkit as ck
from creepkit.discovery.discover import discover, group_by_temperature
from creepkit.records import History, constant_stress

T_REF, TRUTH = 1033.15, {"n_0": 3.6, "n_inf": 4.4, "C": 1.0, "tau_d": 6000.0, "tau_r": 2500.0}
A, Q, SLOPE = 4e-16, 4.1e5, -4e-3


def strain(times, stress, T):
    """Integral of A exp[-(Q/R)(1/T - 1/T_ref)] s^n(t) over time, by Simpson's rule; n_inf is linear in T."""
    n_inf = TRUTH["n_inf"] + SLOPE * (T - T_REF)
    n = n_inf + (TRUTH["C"] + TRUTH["n_0"] - n_inf) * np.exp(-times / TRUTH["tau_d"])
    n = n - TRUTH["C"] * np.exp(-times / TRUTH["tau_r"])
    rate = A * np.exp(-Q / 8.314462618 * (1 / T - 1 / T_REF)) * stress**n
    return cumulative_simpson(rate, x=times, initial=0)


@pytest.fixture(scope="module")
def campaign():
    """What discover finds, and the steps that it reports."""
    rng, tests, fine, used = np.random.default_rng(4), [], np.linspace(0, 30000, 6001), np.geomspace(300, 30000, 24)
    for T in (973.15, 1013.15, 1053.15, 1093.15):
        for stress in (60.0, 85.0, 120.0):
            exact = np.interp(used, fine, strain(fine, stress, T))
            sd = np.full(used.size, max(1e-5, 3e-3 * exact[-1]))
            measured = {"strain": exact + rng.normal(0, 1, used.size) * sd}
            loading = constant_stress(stress, "stress")
            tests.append(
                History(f"{stress:g} MPa {T:g} K", used, measured, loading, T, standard_deviation={"strain": sd})
            )
    law, steps = ck.law("drifting-exponent").fix(m=0), []
    fits = [ck.identify(law, group) for group in group_by_temperature(tests)]
    found = discover(fits, histories=tests, progress=lambda *step: steps.append(step))
    return found, steps


def test_the_planted_forms_are_found_among_the_default_ones(campaign):
    found, _ = campaign
    for name in ("n_0", "C", "tau_d", "tau_r"):
        assert found.forms[name] == "constant"
    assert found.forms["A"] == "arrhenius"
    assert "linear" in [form.name for form in found.plausible_forms["n_inf"]]
    assert found.adequacy.verdict == "explains"


def test_the_planted_values_lie_in_their_intervals(campaign):
    found, _ = campaign
    values = {"A": A, "Q": Q, **TRUTH} | ({"n_inf_T": SLOPE} if found.forms["n_inf"] == "linear" else {})
    outside = [name for name, value in values.items() if not _inside(found.estimate(name), value)]
    assert len(outside) <= 1  # of eight intervals at 95 %
    T = np.array([973.15, 1093.15])
    assert found.parameters_at(T)["n_inf"] == pytest.approx(TRUTH["n_inf"] + SLOPE * (T - T_REF), abs=0.05)


def _inside(estimate, value):
    return estimate.low <= value <= estimate.high


def test_how_long_it_takes_is_said_after_the_first_of_its_parts(campaign):
    _, steps = campaign
    names = list(dict.fromkeys(name for name, _, _ in steps))
    assert len(names) == 2
    for name, what in zip(names, ("combinations of forms", "refits of forms"), strict=True):
        assert f"{what} at most, about " in name


def test_few_refits_are_made(campaign):
    """An identification of all tests is what costs; it was one for each of 35 before."""
    found, _ = campaign
    assert len(found.candidates) <= 9
