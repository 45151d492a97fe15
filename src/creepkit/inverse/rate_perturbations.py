"""Perturbations of the rates of tests: a linear problem reduced to one small matrix a test, and their evidence."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from creepkit.arrays import Floats
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel
from creepkit.inverse.variance_components import LARGEST_RATE_SCATTER, LinearisedProblem

SCATTERS = np.geomspace(1e-3, LARGEST_RATE_SCATTER, 25)
"""Of ln rate between tests, over which evidence is averaged."""


SMALLEST_FACTOR = 0.1
"""Of ln rate: a smaller deviation of a test is no finding, however exact the tests are."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """ln of the evidence of an explanation.

    mean, sd : (columns,) of the coefficients. step : (unknowns,) of all unknowns.
    """

    log: float
    mean: Floats
    sd: Floats
    step: Floats


class RatePerturbations:
    """The problem made linear, reduced to one small matrix a test, for perturbations of the rates of tests.

    Unknowns at their bounds are free: an explanation may be what brought them there. contrasts : how many combinations
    of the rates of tests no unknown of the law moves.
    own_log_factors, median_log_factors : (tests,) of ln of the factor on the rate that each test alone shows beside the
    law as it is, by least squares, and the median of those of its readings.
    """

    def __init__(self, linear: LinearisedProblem, noise_model: NoiseModel, *, scatter_known: bool) -> None:
        """scatter_known : whether the scatter of rates is what the noise model says and no grid is averaged."""
        residuals = linear.residuals.with_test_weights(np.ones(len(linear.residuals.values)))
        assert residuals.jacobian is not None
        columns = np.concatenate(
            [residuals.values[..., None], residuals.jacobian, residuals.log_rate_sensitivity[..., None]], axis=-1
        )
        factor = CovarianceFactor.of_residuals(residuals, replace(noise_model, rate=0.0))
        whitened = np.where(residuals.present[..., None], factor.whiten(columns), 0.0)
        gram = np.einsum("tem,ten->tmn", whitened, whitened)
        scatters = np.array([noise_model.rate]) if scatter_known else SCATTERS
        own = scatters[:, None] ** 2 / (1.0 + scatters[:, None] ** 2 * gram[None, :, -1, -1])
        row = gram[:, :, -1]
        self.gram = gram[None] - own[..., None, None] * (row[:, :, None] * row[:, None, :])[None]
        self.own_log_factors = -gram[:, -1, 0] / np.maximum(gram[:, -1, -1], 1e-300)
        sensitive = residuals.present & (residuals.log_rate_sensitivity > 0.5)
        ratios = [
            -r[k] / d[k] for r, d, k in zip(residuals.values, residuals.log_rate_sensitivity, sensitive, strict=True)
        ]
        self.median_log_factors = np.array([np.median(r) if r.size else np.nan for r in ratios])
        design = row[:, 1:-1] / np.maximum(row[:, -1:], 1e-300) / np.sqrt(np.maximum(linear.precision, 1e-300))
        self.contrasts = len(gram) - int((np.linalg.svd(design, compute_uv=False) > SMALLEST_FACTOR).sum())
        self.log_determinant = np.log1p(scatters[:, None] ** 2 * gram[None, :, -1, -1]).sum(axis=1)
        self.precision, self.prior_residual = linear.precision, linear.prior_residual

    def evidence(self, weights: Floats, prior_sd: Floats) -> Evidence:
        """Of ln rates moved by weights times coefficients.

        weights : (tests, columns). prior_sd : (columns,) prior standard deviations of the coefficients.
        """
        unknowns = self.precision.size
        total = self.gram.sum(axis=1)
        rows = np.einsum("tq,stm->sqm", weights, self.gram[..., -1])
        of_rates = np.einsum("tq,tp,st->sqp", weights, weights, self.gram[..., -1, -1]) + np.diag(1.0 / prior_sd**2)
        across, own = rows[:, :, 1:-1], total[:, 1:-1, 1:-1] + np.diag(self.precision)
        normal = np.block([[own, np.swapaxes(across, 1, 2)], [across, of_rates]])
        side = np.concatenate([total[:, 1:-1, 0] + self.precision * self.prior_residual, rows[:, :, 0]], axis=1)
        scale = np.sqrt(np.diagonal(normal, axis1=1, axis2=2))
        scaled = normal / scale[:, :, None] / scale[:, None, :]
        inverse = np.linalg.inv(scaled) / scale[:, :, None] / scale[:, None, :]
        step = -np.einsum("spq,sq->sp", inverse, side)
        chi_square = total[:, 0, 0] + (self.precision * self.prior_residual**2).sum() + (side * step).sum(axis=1)
        determinant = np.linalg.slogdet(scaled)[1] + 2 * np.log(scale).sum(axis=1)
        logs = -0.5 * (self.log_determinant + determinant + 2 * np.log(prior_sd).sum() + chi_square)
        share = np.exp(logs - logsumexp(logs))
        mean = share @ step
        variance = share @ (np.diagonal(inverse, axis1=1, axis2=2) + (step - mean) ** 2)
        return Evidence(
            float(logsumexp(logs) - np.log(len(logs))), mean[unknowns:], np.sqrt(variance[unknowns:]), mean[:unknowns]
        )
