"""Figures of a test with a step of temperature beside tests at one: its levels are named, and no mean of them."""

import numpy as np
import pytest

from creepkit.inverse.identification import IdentificationSettings
from creepkit.inverse.identify import identify
from creepkit.kernels import lower
from creepkit.language import arrhenius
from creepkit.laws.norton import NORTON
from creepkit.records import History, Program, constant_stress
from creepkit.reports.prediction_bands import rates_of_tests
from creepkit.specimens.uniaxial import Uniaxial

LAW = NORTON.times(arrhenius(T_ref=873.15))
TRUTH = {"A": 1e-16, "n": 5.2, "Q": 350e3}
COLD, HOT, HALF = 873.15, 893.15, 3600.0


def rate(stress, kelvin):
    return float(lower(LAW, "numpy").rate(TRUTH, stress=stress, temperature=kelvin))


def stepped_test(stress):
    """Strain grows at the rate at COLD until HALF and then at that at HOT."""
    times = np.linspace(HALF / 20, 2 * HALF, 40)
    strain = rate(stress, COLD) * np.minimum(times, HALF) + rate(stress, HOT) * np.maximum(times - HALF, 0.0)
    program = Program((0.0, HALF, HALF, 2 * HALF), (COLD, COLD, HOT, HOT))
    return History("stepped", times, {"strain": strain}, constant_stress(stress, "stress"), program)


def steady_test(stress, kelvin):
    times = np.linspace(HALF / 20, 2 * HALF, 40)
    name = f"{stress:g} MPa at {kelvin:g} K"
    strain = rate(stress, kelvin) * times
    return History(name, times, {"strain": strain}, constant_stress(stress, "stress"), kelvin)


@pytest.fixture(scope="module")
def fit():
    tests = [steady_test(s, T) for T in (COLD, HOT) for s in (200.0, 230.0)]
    settings = IdentificationSettings(starts=2, sobol_points=16, frames=20)
    return identify(LAW, [*tests, stepped_test(215.0)], Uniaxial(), settings=settings)


def test_each_hold_of_temperature_shows_the_rate_at_that_temperature(fit):
    shown = [r for r in rates_of_tests(fit, fit.predict()) if r.test == 4]
    assert [(r.stress, r.temperature) for r in shown] == [(pytest.approx(215.0), COLD), (pytest.approx(215.0), HOT)]
    for one in shown:
        assert one.rate == pytest.approx(rate(215.0, one.temperature), rel=0.01)
