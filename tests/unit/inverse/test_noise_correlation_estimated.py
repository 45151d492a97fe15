"""Correlated noise of outputs whose standard deviations are not stated but estimated from the residuals."""

from __future__ import annotations

import numpy as np
import pytest

from creepkit.inverse.identify import identify
from creepkit.inverse.settings import IdentificationSettings
from helpers.correlated_noise import LAW, PAIR, least_squares, measured
from helpers.two_outputs_predictor import TwoOutputs

SETTINGS = IdentificationSettings(starts=1, sobol_points=8, frames=60, weights="likelihood", nuisances=())


def unstated(rho: float, seed: int, told: bool):
    """Tests whose noise is correlated by rho; told : whether they say so."""
    return [
        h.replace(standard_deviation={}, noise_correlation={PAIR: rho} if told else {}) for h in measured(rho, seed)
    ]


@pytest.mark.parametrize("rho", [0.9, -0.9])
def test_the_correlation_acts_where_the_noise_is_estimated(rho: float) -> None:
    """Estimates and intervals are those of generalised least squares with the noise that was planted.

    Over four draws the mean half width lies within 25 % of 1.96 of its standard deviations (the noise is estimated from
    60 frames of each output, some 9 %), and the likelihood is higher with the correlation than without.
    """
    widths, gains = [], []
    for seed in range(4):
        told = identify(LAW, unstated(rho, seed, True), TwoOutputs(), settings=SETTINGS)
        silent = identify(LAW, unstated(rho, seed, False), TwoOutputs(), settings=SETTINGS)
        one = told.estimates[0]
        widths.append(0.5 * float(np.log(one.high / one.low)))
        gains.append(told.log_likelihood - silent.log_likelihood)
        assert np.isfinite([one.low, one.value, one.high]).all()
    sd = least_squares(measured(rho, 0), rho)[1]
    assert np.mean(widths) == pytest.approx(1.96 * sd, rel=0.25)
    assert min(gains) > 20.0  # 60 frames of two outputs at 0.9: about -30 ln(1 - 0.81) = 50
