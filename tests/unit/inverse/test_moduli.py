"""Moduli from the first frames of bulge tests: planted ones are found, and Wachtman's form through them."""

from dataclasses import replace

import numpy as np
import pytest

from creepkit.discovery.discover import fit_wachtman, moduli
from creepkit.inverse.identification import IdentificationSettings
from creepkit.language import Elastic, arrhenius
from creepkit.laws.norton import NORTON
from helpers.reduced_bulge_predictor import OneDegree, Plan, planted

LAW = NORTON.times(arrhenius(T_ref=1048.15))
TRUTH = {"A": 3e-16, "n": 4.5, "Q": 420e3}
QUICK = IdentificationSettings(starts=1, sobol_points=8, frames=15)


def test_moduli_that_the_histories_state_wrongly_are_found() -> None:
    """Planted 180 GPa - .1 GPa/C; the histories state 15 % too much. Noise 1.5 um of some 60 um."""
    plans = [Plan(c, 8.0, 8.0) for c in (720, 740, 760, 780, 800)]
    tests = planted(LAW, TRUTH, plans, seed=5, frames=96)
    stated = [replace(h, elastic=Elastic(1.15 * float(h.elastic.E))) for h in tests]
    found = moduli(LAW, stated, OneDegree(exact=True), settings=QUICK)
    planted_moduli = np.array([float(h.elastic.E) for h in tests])
    assert (np.abs(found.values - planted_moduli) < 4 * found.sd).all()
    assert (np.abs(found.values / planted_moduli - 1) < 0.05).all()
    assert found.elastic is not None
    assert found.elastic.at(760 + 273.15).E == pytest.approx(104e3, rel=0.03)


def test_wachtman_through_its_own_values() -> None:
    """The paper's Fig. 6c: 177.5 - .21 T exp(-948.5/T) GPa; three numbers from exact values of five temperatures."""
    T = np.array([300.0, 600.0, 900.0, 1050.0, 1150.0])
    E = 177.5e3 - 210.0 * T * np.exp(-948.5 / T)
    E0, b, T0 = fit_wachtman(T, E, np.full(5, 1e3))
    assert (E0, b, T0) == pytest.approx((177.5e3, 210.0, 948.5), rel=1e-5)
