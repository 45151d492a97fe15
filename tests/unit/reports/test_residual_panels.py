"""Residuals of reports: the numbers by which a law is judged, an axis that most tests need, and texts that say so."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest

from creepkit.inverse.identify import identify
from creepkit.inverse.settings import IdentificationSettings
from creepkit.laws.norton import NORTON
from creepkit.reports.judged_readings import judged_readings
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
