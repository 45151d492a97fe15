"""The plot of an identification: its panels, labels, bands and legends, for a few tests and for 84."""

import numpy as np
import pytest

from creepkit.inverse.identification import IdentificationSettings
from creepkit.inverse.identify import identify
from creepkit.language import arrhenius
from creepkit.laws.norton import NORTON
from creepkit.reports.figures import LARGEST_PIXELS, RESOLUTION
from helpers.steady_rate_predictor import Steady, planted

LAW = NORTON.times(arrhenius(T_ref=1073.15))
TRUTH = {"A": 1e-16, "n": 5.2, "Q": 350e3}
QUICK = IdentificationSettings(starts=2, sobol_points=16, frames=20)


def fitted(conditions):
    tests = planted(LAW, TRUTH, conditions, seed=5, rate=0.2, offset=5e-5, noise=1e-5)
    return identify(LAW, tests, Steady(), settings=QUICK)


@pytest.fixture(scope="module")
def few():
    return fitted([(s, T) for T in (1000.0, 1050.0, 1100.0) for s in (30.0, 50.0, 80.0)])


@pytest.fixture(scope="module")
def many():
    return fitted([(s, T) for T in np.linspace(1023.15, 1173.15, 6) for s in np.geomspace(40, 200, 14)])


def test_a_few_tests_have_curves_and_rates_with_units(few, tmp_path):
    figure = few.plot(tmp_path / "fit.png")
    panels = [axes for axes in figure.axes if axes.get_xlabel()]
    assert [axes.get_ylabel() for axes in panels] == ["strain, %", "creep rate, %/h"]
    assert [axes.get_xlabel() for axes in panels] == ["time, h", "von Mises stress, MPa"]
    assert (tmp_path / "fit.png").stat().st_size > 10_000


def test_84_tests_have_a_colour_scale_and_fit_on_a_page(many):
    figure = many.plot()
    assert not figure.legends
    assert any(axes.get_ylabel() == "temperature, °C" for axes in figure.axes)  # the colour bar
    assert RESOLUTION * max(figure.get_size_inches()) < LARGEST_PIXELS
    dots = [line for axes in figure.axes for line in axes.lines if line.get_marker() == "."]
    assert len(dots) == 84
