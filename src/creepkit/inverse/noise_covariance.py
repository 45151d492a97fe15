"""The covariance of residuals by its factors, and likelihoods under it, linear in observations.

A covariance of Ornstein-Uhlenbeck processes, random effects and white noise is that of a state-space model: whitening
by its Cholesky factor is a Kalman filter, which the compiled core runs (src/core/noise_likelihood.hpp).

Tests that were stopped before rupture count by the probability that a test lasts as long as it did. With
r = ln(t_stop / t_r) by the law, m and s^2 its mean and variance given the other readings of the test, one contributes
ln S(z), z = (r - m) / s, S the upper tail of the normal distribution. About any point it is, to second order, a
Gaussian observation: with the hazard h = phi(z) / S(z) its gradient is h / s, its curvature h (h - z) / s^2, as those
of a residual s / (h - z) of variance s^2 / (h (h - z)). That is what least squares and REML are given, anew in each
round; the derivative to ln s is that of ln S, too, so that the rounds end at the maximum of the likelihood.

Source: J. Tobin (1958), Econometrica 26, 24; J. Schmee and G. Hahn (1979), Technometrics 21, 417.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr

from creepkit.arrays import Bools, Floats
from creepkit.core import address, function
from creepkit.errors import FitError
from creepkit.inverse.noise_model import NoiseModel, Residuals, StoppedTests
from creepkit.inverse.observation_series import ObservationSeries

ABSOLUTE_JITTER, RELATIVE_JITTER = 1e-10, 1e-9
"""Of variances, as in src/core/noise_likelihood.hpp."""


def _check(code: int) -> None:
    """Raise what a function of the core returned."""
    if code == 1:
        raise FitError("the covariance of the residuals has no factors: a prediction is far beyond what was measured")
    if code:
        raise FitError("the likelihood of the noise needs more memory than there is" if code == 2 else "wrong counts")


@dataclass(frozen=True, eq=False)
class CovarianceFactor:
    """The covariance C = L L' of all tests; L^-1 r is white.

    series : of the observations. components : (5 outputs + 4,) as NoiseModel.components has them. common : (tests,
    observations, effects) S of errors that tests have alike, or None for none.

    With B = L_0 L_0' the blocks of single tests and U D V' the singular value decomposition of L_0^-1 S,
    C = B + S S' is L_0 (1 + U D^2 U') L_0', and its inverse root [1 - U (1 - (1 + D^2)^-1/2) U'] L_0^-1.
    """

    series: ObservationSeries
    components: Floats
    common: Floats | None = None

    @classmethod
    def of_residuals(cls, residuals: Residuals, noise_model: NoiseModel) -> CovarianceFactor:
        """The covariance of residuals under a noise model."""
        return cls(residuals.series, noise_model.components, common=residuals.common_effects)

    def whiten(self, values: Floats) -> Floats:
        """L^-1 v of values (tests, observations[, columns]), of the same shape; observations without data stay."""
        whitened = self._transformed(values, inverse=False)[0]
        if self.common is None:
            return whitened
        left, squares = self._common_modes
        rows = whitened.reshape(len(left), -1)
        shrunk = rows - left @ ((1.0 - 1.0 / np.sqrt(1.0 + squares))[:, None] * (left.T @ rows))
        return np.asarray(shrunk.reshape(whitened.shape))

    def inverse_times(self, values: Floats) -> Floats:
        """C^-1 v of values (tests, observations[, columns]), of the same shape; observations without data stay."""
        weighted = self._transformed(values, inverse=True)[0]
        if self.common is None:
            return weighted
        common = self._transformed(self.common, inverse=True)[0].reshape(-1, self.common.shape[-1])
        inner = np.eye(common.shape[1]) + self.common.reshape(common.shape).T @ common
        rows = common.T @ values.reshape(len(common), -1)
        return np.asarray(weighted - (common @ np.linalg.solve(inner, rows)).reshape(weighted.shape))

    @cached_property
    def log_determinant(self) -> float:
        """ln|C| over all tests."""
        own = self._transformed(np.zeros((*self.series.shape, 0)), inverse=False)[1]
        return own if self.common is None else own + float(np.log1p(self._common_modes[1]).sum())

    @cached_property
    def _common_modes(self) -> tuple[Floats, Floats]:
        """U, (tests x observations, effects), and the squares of D, (effects,)."""
        assert self.common is not None
        rows = self._transformed(self.common, inverse=False)[0].reshape(-1, self.common.shape[-1])
        left, values, _ = np.linalg.svd(rows, full_matrices=False)
        return left, values**2

    @cached_property
    def blocks(self) -> Floats:
        """(tests, observations, observations) B of each test: 1 on the diagonal for observations without data."""
        return np.asarray(self.roots @ np.swapaxes(self.roots, 1, 2))

    @cached_property
    def standard_deviations(self) -> Floats:
        """(tests, observations) of each observation, with all effects: 1 of those without data."""
        series, shared, variances = self.series, self.components[-4:], np.ones(self.series.shape)
        noise, misfit, offset, drift, _ = self.components[:-4].reshape(-1, 5)[series.output].T
        w, s, u, d, b, *effects = series.loadings[:, 1 : 6 + series.effects].T
        states = np.stack([drift, offset * s, shared[2] * u, shared[0] * d, shared[1] * b, *effects])
        of_states, white = (states**2).sum(axis=0), (noise * w) ** 2 + misfit**2
        variances.flat[series.places] = (1.0 + RELATIVE_JITTER) * of_states + white + ABSOLUTE_JITTER
        return np.sqrt(variances if self.common is None else variances + (self.common**2).sum(axis=-1))

    @cached_property
    def roots(self) -> Floats:
        """(tests, observations, observations) R of each test, with B = R R'."""
        tests, count = self.series.shape
        whitening = self._transformed(np.tile(np.eye(count), (tests, 1, 1)), inverse=False)[0]
        return np.asarray(np.linalg.inv(whitening), float)

    def _transformed(self, values: Floats, *, inverse: bool) -> tuple[Floats, float]:
        series, rows = self.series, self.series.rows(values)
        log_determinant = np.zeros(1)
        _check(
            function("creepkit_noise_whiten")(
                *series.arguments(self.components),
                ctypes.c_int64(rows.shape[1]),
                ctypes.c_int64(inverse),
                address(rows),
                address(log_determinant),
            )
        )
        out = np.array(values, float, order="C")
        if rows.size:
            flat = out.reshape(-1, rows.shape[1])
            flat[series.places] = rows
        return out, float(log_determinant[0])


class NoiseLikelihood:
    """-ln L, but for a constant, of residuals that are linear in unknowns, as a function of the noise's components.

    With unknowns it is the restricted likelihood, in which they are integrated out. One thread at a time may call it.
    """

    def __init__(
        self, series: ObservationSeries, values: Floats, precision: Floats, prior_residual: Floats, components: Floats
    ) -> None:
        """values : (tests, observations, 1 + unknowns) residuals and their derivatives to the unknowns.

        precision, prior_residual : (unknowns,) of their priors, and the distance from their means.
        components : (5 outputs + 4,) of a noise model, as NoiseModel.components has them.
        """
        rows, unknowns = series.rows(values), values.shape[-1] - 1
        self._components, self._value, self._gradient = components.copy(), np.zeros(1), np.zeros(components.size)
        priors = [np.ascontiguousarray(prior, float) for prior in (precision, prior_residual)]
        arrays = [rows, *priors, self._value, self._gradient]
        self._kept_alive = series, arrays
        self._arguments = (
            *series.arguments(self._components),
            ctypes.c_int64(unknowns),
            *(address(array) for array in arrays),
        )

    def __call__(self, components: Floats) -> tuple[float, Floats]:
        """Value, and gradient to the logarithms of the components.

        components : (5 outputs + 4,). Returns the value and (5 outputs + 4,) derivatives.
        """
        self._components[:] = components
        _check(function("creepkit_restricted_likelihood")(*self._arguments))
        return float(self._value[0]), self._gradient.copy()


class RandomEffects(NamedTuple):
    """Best linear predictions of what tests have of their own.

    offsets : (tests, outputs) in their units. log_factors : (2, tests) ln of those on the rate, and on the rate of
    damage beside it.
    """

    offsets: Floats
    log_factors: Floats


def predicted_random_effects(residuals: Residuals, noise_model: NoiseModel) -> RandomEffects:
    """What residuals under a noise model say of each test."""
    weighted = CovarianceFactor.of_residuals(residuals, noise_model).inverse_times(-residuals.values)
    weighted_sensitivity = residuals.offset_sensitivity * weighted
    offsets = [
        s.offset**2 * np.where(residuals.output_index == k, weighted_sensitivity, 0.0).sum(axis=1)
        for k, s in enumerate(noise_model.outputs.values())
    ]
    variance = noise_model.rate**2 + (0.0 if residuals.rate_errors is None else residuals.rate_errors**2)
    rates, lives = variance * (residuals.log_rate_sensitivity * weighted).sum(axis=1), np.zeros(len(weighted))
    if residuals.log_life_sensitivity is not None:
        lives = noise_model.life**2 * (residuals.log_life_sensitivity * weighted).sum(axis=1)
    return RandomEffects(np.stack(offsets, axis=1), np.stack([rates, lives]))


def effective_sample_size(residuals: Residuals, noise_model: NoiseModel) -> float:
    """Number of independent observations that carry the same information on a common mean as all frames together."""
    factor = CovarianceFactor.of_residuals(residuals, noise_model.without_offsets)
    standard_deviations = np.where(residuals.present, factor.standard_deviations, 0.0)
    information = float((factor.whiten(standard_deviations) ** 2).sum())
    return float(np.clip(information, len(residuals.values), residuals.present.sum()))


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
