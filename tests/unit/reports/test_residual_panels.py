"""Residuals of reports: the numbers by which a law is judged, an axis that most tests need, and texts that say so."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from creepkit.inverse.identify import identify
from creepkit.inverse.settings import IdentificationSettings
from creepkit.laws.norton import NORTON
from creepkit.reports.curve_of_test import TestCurve
from creepkit.reports.forecast_plot import LONGEST_AXIS, _time_end
from creepkit.reports.judged_readings import judged_readings
from creepkit.reports.test_figure import _end_text
from helpers.steady_rate_predictor import Steady, planted

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification

STRESSES = (60.0, 70.0, 80.0, 90.0, 100.0, 110.0)
NOISE = 1e-5
QUICK = IdentificationSettings(starts=2, sobol_points=16, frames=40)


@cache
def fit(rate: float = 0.1) -> Identification:
    tests = planted(
        NORTON, {"A": 1e-19, "n": 5.0}, [(s, 873.15) for s in STRESSES], seed=3, rate=rate, offset=5e-5, noise=NOISE
    )
    return identify(NORTON, tests, Steady(), settings=QUICK)


def test_the_chi_square_of_all_readings_is_that_of_the_verdict() -> None:
    readings, adequacy = judged_readings(fit()), fit().adequacy
    assert readings is not None
    assert adequacy is not None
    assert readings.chi_square() == pytest.approx(adequacy.chi_square, rel=1e-9)
    counts = [int(readings.mask(k).sum()) for k in range(len(STRESSES))]
    mean = np.average([readings.chi_square(k) for k in range(len(STRESSES))], weights=counts)
    assert mean == pytest.approx(adequacy.chi_square, rel=1e-9)


def test_the_scatter_between_tests_is_in_the_misfit_of_the_common_rate_alone() -> None:
    """Rates that scatter by 10 % move strains of 0.02 by 0.002, some 200 noises; with own rates noise is left."""
    readings = judged_readings(fit())
    assert readings is not None
    common = [readings.misfit_of_common_rate(k) for k in range(len(STRESSES))]
    own = [readings.chi_square(k) for k in range(len(STRESSES))]
    assert np.median(common) > 100.0
    assert 0.3 < np.median(own) < 3.0
    residuals = np.concatenate([readings.residuals(k, "strain")[1] for k in range(len(STRESSES))])
    assert np.sqrt(np.mean(residuals**2)) == pytest.approx(1.0, abs=0.35)


def end_text(identified: list[float], half_width: list[float]) -> str:
    hours, measured = np.arange(1.0, 4.0), np.array([1.0, 2.0, 3.0])
    curve = TestCurve(hours, measured, np.array(identified), np.array(half_width), np.zeros(3), logarithmic=True)
    return _end_text(curve, "%")


def test_a_band_that_spans_decades_is_said_to_be_unbounded() -> None:
    assert "95 % band 2.71 to 3.32" in end_text([1.0, 2.0, 3.0], [0.1, 0.1, 0.1])
    assert "unbounded" in end_text([1.0, 2.0, 90.0], [0.1, 0.1, 50.0])
    assert "e+" not in end_text([1.0, 2.0, 90.0], [0.1, 0.1, 50.0])
    assert "follows 2 readings, to 2 h" in end_text([1.0, 2.0, float("nan")], [0.1, 0.1, float("nan")])


@pytest.mark.parametrize(("high", "end"), [(991.0, 991.0), (1e6, LONGEST_AXIS * 300.0)])
def test_the_axis_of_a_forecast_holds_the_interval_of_the_rupture_time(high: float, end: float) -> None:
    """The interval of a strain carries the axis to 513 h, within which that of the rupture time begins."""
    times = [SimpleNamespace(low=3600.0 * a, high=3600.0 * b) for a, b in ((341.0, high), (115.0, 513.0))]
    assert _time_end(SimpleNamespace(times=times), 300.0) == pytest.approx(end)
