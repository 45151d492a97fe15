"""The stress exponent of bars compared at one strain, against closed forms of time and strain hardening."""

from __future__ import annotations

import numpy as np
import pytest

import creepkit as ck
from creepkit.inverse.identified_values import state_at_strain
from creepkit.inverse.tested_region import outside_combinations

A, N, M = 1e-13, 4.0, -0.4
TIMES = np.geomspace(360.0, 3.6e5, 30)


def curves() -> list[ck.History]:
    """Strain A s^n t^(1 + m) / (1 + m) under constant true stress, with 0.5 % of noise."""
    rng = np.random.default_rng(3)
    return [
        ck.History(
            f"{stress:g} MPa",
            TIMES,
            {"strain": A * stress**N * TIMES ** (1 + M) / (1 + M) * (1 + 0.005 * rng.standard_normal(TIMES.size))},
            ck.constant_stress(stress, "stress"),
            1000.0,
            strain_measure="logarithmic",
        )
        for stress in (40.0, 60.0, 90.0)
    ]


def test_time_hardening_has_n_over_one_plus_m_at_constant_strain() -> None:
    fit = ck.identify("time-hardening", curves(), starts=1)
    state = state_at_strain(fit)
    assert state is not None
    n, m = fit.values["n"], fit.values["m"]
    assert state.exponent[0] == pytest.approx(n / (1 + m), rel=1e-4)
    assert state.exponent[1] < N / (1 + M) < state.exponent[2]
    assert float(fit.local_exponent(60.0)[0]) == pytest.approx(n, rel=1e-6)
    r = fit.reference
    reached = (r.strain * (1 + m) / (fit.values["A"] * r.stress**n)) ** (1 / (1 + m))
    assert state.time[0] == pytest.approx(reached, rel=1e-4)
    assert state.rate[0] == pytest.approx((1 + m) * r.strain / reached, rel=1e-4)
    assert "at constant time is" in fit.details()
    assert "stress exponent at constant strain" in fit.details()


def test_a_combination_outside_the_hull_of_the_tests() -> None:
    fit = ck.identify("time-hardening", curves(), starts=1)
    at = np.array([1000.0])
    assert not outside_combinations(fit, np.array([70.0]), at)
    assert "120 MPa at 727 °C" in outside_combinations(fit, np.array([120.0]), at)
