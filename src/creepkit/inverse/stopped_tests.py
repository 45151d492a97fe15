"""Tests that were stopped before rupture, in the likelihood: the probability that a test lasts as long as it did.

With r = ln(t_stop / t_r) by the law, m and s^2 its mean and variance given the other readings of the test, a stopped
test contributes ln S(z), z = (r - m) / s, S the upper tail of the normal distribution. About any point it is, to
second order, a Gaussian observation: with the hazard h = phi(z) / S(z) its gradient is h / s, its curvature
h (h - z) / s^2, as those of a residual s / (h - z) of variance s^2 / (h (h - z)). That is what least squares and REML
are given, anew in each round; the derivative to ln s is that of ln S, too, so that the rounds end at the maximum of the
likelihood.

Source: J. Tobin (1958), Econometrica 26, 24; J. Schmee and G. Hahn (1979), Technometrics 21, 417.
"""

from __future__ import annotations

import numpy as np
from scipy.special import log_ndtr

from creepkit.arrays import Bools, Floats
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel, Residuals, StoppedTests

HALF_LOG_TAU = 0.5 * float(np.log(2.0 * np.pi))


LEAST_CERTAIN = -6.0
"""Standard deviations: a test that was stopped this long before its rupture says nothing."""


def log_survival(z: Floats) -> tuple[Floats, Floats]:
    """ln of the probability that a standard normal value is above z (...,), and the hazard."""
    lasting = log_ndtr(-z)
    exponent = np.minimum(-0.5 * z**2 - HALF_LOG_TAU - lasting, 700.0)
    return lasting, np.minimum(np.exp(exponent), np.maximum(z, 0.0) + 1.0)  # of which it never has more: rounding


def stopped_tests(residuals: Residuals, noise_model: NoiseModel, stopped: Bools) -> StoppedTests:
    """What stopped tests say about a point; residuals : there, as if these had broken at their ends.

    stopped : (tests, observations) which these ends are.
    """
    columns = np.stack([residuals.values, stopped.astype(float)], axis=-1)
    weighted = CovarianceFactor.of_residuals(residuals, noise_model).inverse_times(columns)[stopped]
    late, s = weighted[:, 0] / weighted[:, 1], weighted[:, 1] ** -0.5
    z = np.maximum(late / s, LEAST_CERTAIN)
    lasting, hazard = log_survival(z)
    gap = hazard - z
    shift, sd = np.zeros((2, *stopped.shape))
    shift[stopped] = s / gap - late
    sd[stopped] = s * np.sqrt(np.maximum(1.0 / (hazard * gap) - 1.0, 0.0))
    chi_square = float((-2.0 * lasting - hazard / gap).sum())
    return StoppedTests(shift, sd, chi_square, float(np.log(hazard * gap / s**2).sum()))
