"""Variance components by maximum likelihood and by restricted maximum likelihood (REML), with exact gradients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from creepkit.arrays import Bools, Floats
from creepkit.inverse.noise_model import (
    NoiseModel,
    Residuals,
    components_fixed_by_priors,
    correlation_lags,
    covariance,
    same_output,
)
from creepkit.records import Nuisance

BOUND_TOLERANCE = 1e-6
"""Of the width of the bounds: an unknown nearer to its bound than this is fixed there."""


@dataclass(frozen=True, eq=False)
class LinearisedProblem:
    """A problem made linear where its residuals were taken.

    residuals : with their derivatives to all unknowns. precision, prior_residual : (unknowns,) of the priors, and the
    distance from their means. free : (unknowns,) which are not at their bounds. step_bounds : (2, unknowns) least and
    largest step within the bounds.
    """

    residuals: Residuals
    precision: Floats
    prior_residual: Floats
    free: Bools
    step_bounds: Floats

    @property
    def jacobian(self) -> Floats:
        """(tests, observations, free unknowns) derivatives of the residuals."""
        assert self.residuals.jacobian is not None
        return self.residuals.jacobian[..., self.free]

    def solve(self, inverses: Floats) -> LinearSolution:
        """The optimum under covariances of given inverses (tests, observations, observations)."""
        J, p = self.jacobian, self.precision[self.free]
        weighted_jacobian = inverses @ J
        normal_matrix = np.einsum("tep,teq->pq", J, weighted_jacobian) + np.diag(p)
        covariance = scaled_inverse(normal_matrix)
        prior_residual = self.prior_residual.copy()
        step = -covariance @ (
            np.einsum("tep,te->p", weighted_jacobian, self.residuals.values) + p * prior_residual[self.free]
        )
        prior_residual[self.free] += step
        residuals = self.residuals.values + J @ step
        weighted_residuals = (inverses @ residuals[..., None])[..., 0]
        chi2 = float((residuals * weighted_residuals).sum() + (self.precision * prior_residual**2).sum())
        return LinearSolution(
            step,
            residuals,
            weighted_residuals,
            weighted_jacobian,
            covariance,
            chi2,
            -float(np.linalg.slogdet(covariance)[1]),
        )


@dataclass(frozen=True, eq=False)
class LinearSolution:
    """The optimum of a linear problem.

    step : (free unknowns,). residuals : (tests, observations) r. weighted_residuals : (tests, observations) C^-1 r.
    weighted_jacobian : (tests, observations, free unknowns) C^-1 J. covariance : (free unknowns, free unknowns) A^-1.
    chi_square : with priors. log_det : ln|A|.
    """

    step: Floats
    residuals: Floats
    weighted_residuals: Floats
    weighted_jacobian: Floats
    covariance: Floats
    chi_square: float
    log_det: float


def inverse_covariances(residuals: Residuals, noise_model: NoiseModel) -> tuple[Floats, float]:
    """C^-1 of every test, (tests, observations, observations), and ln|C| over all of them.

    Outputs that share nothing are inverted one by one.
    """
    c = covariance(residuals, noise_model)
    if noise_model.rate > 0 or residuals.random_effect_sensitivities is not None:
        return np.asarray(np.linalg.inv(c)), float(np.linalg.slogdet(c)[1].sum())
    out, log_det = np.zeros_like(c), 0.0
    for test, (present, output) in enumerate(zip(residuals.present, residuals.output_index, strict=True)):
        out[test][np.diag_indices_from(out[test])] = 1.0
        for position in np.unique(output[present]):
            indices = np.flatnonzero(present & (output == position))
            block = np.ix_(indices, indices)
            inverse_factor = np.linalg.inv(np.linalg.cholesky(c[test][block]))
            out[test][block] = inverse_factor.T @ inverse_factor
            log_det -= 2.0 * float(np.log(np.diag(inverse_factor)).sum())
    return out, log_det


def restricted_log_likelihood(linearised: LinearisedProblem, noise_model: NoiseModel) -> float:
    """ln L but for a constant; ln|A| over all unknowns, so that it does not jump where one meets its bound."""
    inverses, log_det = inverse_covariances(linearised.residuals, noise_model)
    unconstrained = replace(linearised, free=np.ones_like(linearised.free)).solve(inverses)
    priors = float(np.log(linearised.precision[linearised.precision > 0]).sum())
    return -0.5 * (log_det + unconstrained.log_det - priors + linearised.solve(inverses).chi_square)


def log_noise_prior(noise_model: NoiseModel) -> float:
    """ln of the prior of the white noise of outputs whose noise is stated, but for a constant."""
    return -0.5 * sum(_log_excess_of_stated(noise_model, name, "noise") ** 2 for name in noise_model.outputs)


def _log_excess_of_stated(noise_model: NoiseModel, output: str, name: str) -> float:
    """ln of the noise over what was stated, in standard deviations of its prior; 0 of all else."""
    stated = noise_model[output].stated if name == "noise" else 0.0
    return float(np.log(noise_model[output].noise / stated)) / NOISE_PRIOR_SD if stated > 0 else 0.0


def scaled_inverse(matrix: Floats) -> Floats:
    """Inverse (n, n) of a positive definite matrix (n, n) whose rows differ by orders of magnitude."""
    scale = np.sqrt(np.diag(matrix))
    return np.asarray(np.linalg.inv(matrix / np.outer(scale, scale)) / np.outer(scale, scale))


LONGEST_CORRELATION = 3.0
"""Longest correlation of a discrepancy, a factor 20 in time or 0.6 of a test: what lasts longer is scatter of the rate.
"""


LONGEST_DRIFT = 0.5
"""Longest correlation of the noise of an instrument, a tenth of a test: what lasts longer is a model discrepancy."""


SHORTEST_CORRELATION, SHORTEST_DISCREPANCY = 0.05, 0.25
"""Shortest correlations of an instrument's noise and of a discrepancy: a hundredth and a twentieth of a test."""


LARGEST_RATE_SCATTER = 1.0
"""Of ln rate between tests, a factor of 2.7: a law that needs more misses what the tests differ in."""


LARGEST_DISCREPANCY = 1e4
"""In noises."""


NOISE_PRIOR_SD = 0.2
"""Of ln of the white noise over what the histories state, from which on it is bounded."""


SMALLEST_NOISE_RATIO, LARGEST_NOISE_RATIO = 0.1, 30.0
"""Of the noise that was stated or estimated from neighbouring frames: where an estimate of it may go."""


OVERSHOOT = float(np.log(30.0))
"""Decrease of the logarithm of a component that may have overshot to where the likelihood hardly depends on it: the
search is repeated from half way."""


NOISE_COMPONENTS = ("noise", "misfit", "offset", "drift", "correlation_length")


SHARED_COMPONENTS = ("rate", "discrepancy", "discrepancy_length")
"""Components that outputs share; they belong to the output ""."""


def estimate_variance_components(
    residuals: Residuals,
    start: NoiseModel,
    nuisances: Sequence[Nuisance],
    *,
    fixed: Sequence[str] = ("noise",),
    linearised: LinearisedProblem | None = None,
    longest_drift: float = LONGEST_CORRELATION,
) -> NoiseModel:
    """The noise model of largest likelihood, beginning from `start`.

    Components at zero, named in `fixed` or with a given prior stay; by default the noise, which was measured.
    linearised : with it the likelihood is the restricted one, parameters of the law integrated out.
    longest_drift : longest correlation of the drifts, in correlation time.
    """
    fixed_by_prior = components_fixed_by_priors(nuisances, list(start.outputs))
    free = [
        (o, n)
        for n in NOISE_COMPONENTS
        for o, components in start.outputs.items()
        if getattr(components, n) > 0
        and (o, n) not in fixed_by_prior
        and n not in fixed
        and (n != "correlation_length" or components.drift > 0)
    ]
    free += [("", "rate")] if start.rate > 0 and ("", "rate") not in fixed_by_prior else []
    free += [("", "discrepancy"), ("", "discrepancy_length")] if start.discrepancy > 0 else []
    if not free:
        return start
    likelihood = _Likelihood(residuals, start, free, linearised)
    bounds = [
        (float(np.log(SHORTEST_CORRELATION)), float(np.log(longest_drift)))
        if name == "correlation_length"
        else _bounds(residuals, start, output, name)
        for output, name in free
    ]
    x0 = np.array(
        [np.clip(np.log(_component(start, *component)), *b) for component, b in zip(free, bounds, strict=True)]
    )
    optimum = _minimised(likelihood, x0, bounds)
    overshot = optimum.x < x0 - OVERSHOOT
    if overshot.any() and linearised is None:
        optimum = min(
            optimum,
            _minimised(likelihood, np.where(overshot, x0 - 0.5 * OVERSHOOT, optimum.x), bounds),
            key=lambda end: end.fun,
        )
    return likelihood.noise_model(optimum.x)


def _minimised(likelihood: _Likelihood, x0: Floats, bounds: Sequence[tuple[float, float]]) -> OptimizeResult:
    inside = np.clip(x0, [low for low, _ in bounds], [high for _, high in bounds])
    options = {"maxiter": 60, "ftol": 1e-9 if likelihood.linear is None else 1e-7}
    return minimize(likelihood.cost, inside, jac=True, method="L-BFGS-B", bounds=bounds, options=options)


class _Likelihood:
    """-ln L, but for a constant, as a function of the logarithms of some components."""

    def __init__(
        self,
        residuals: Residuals,
        start: NoiseModel,
        free: Sequence[tuple[str, str]],
        linearised: LinearisedProblem | None = None,
    ) -> None:
        self.residuals, self.start, self.free, self.linear = residuals, start, free, linearised
        self.names, self.time_lags = list(start.outputs), correlation_lags(residuals)
        present = residuals.present[:, :, None] & residuals.present[:, None, :]
        self.same_output = same_output(residuals) & present

    def noise_model(self, x: Floats) -> NoiseModel:
        """The noise model with these logarithms of the free components, (components,)."""
        noise_model = self.start
        for (output, name), value in zip(self.free, np.exp(x), strict=True):
            noise_model = (
                replace(noise_model, **{name: float(value)})  # type: ignore[arg-type]
                if not output
                else noise_model.with_output(output, **{name: float(value)})
            )
        return noise_model

    def cost(self, x: Floats) -> tuple[float, Floats]:
        """Value and gradient."""
        value, projected, noise_model = self.gradient(x)
        derivative = np.array([self._derivative(projected, noise_model, output, name) for output, name in self.free])
        excess = np.array([_log_excess_of_stated(noise_model, *component) for component in self.free])
        return value + 0.5 * float((excess**2).sum()), derivative + excess / NOISE_PRIOR_SD

    def gradient(self, x: Floats) -> tuple[float, Floats, NoiseModel]:
        """-ln L, G of every test (tests, observations, observations), and the noise model."""
        r, noise_model = self.residuals, self.noise_model(x)
        inverse, log_det = inverse_covariances(r, noise_model)
        if self.linear is None:
            weighted_residuals = (inverse @ r.values[..., None])[..., 0]
            value = 0.5 * (float((r.values * weighted_residuals).sum()) + log_det)
        else:
            solved = self.linear.solve(inverse)
            weighted_residuals = solved.weighted_residuals
            value = 0.5 * (log_det + solved.log_det + solved.chi_square)
            inverse = inverse - solved.weighted_jacobian @ solved.covariance @ np.swapaxes(
                solved.weighted_jacobian, 1, 2
            )
        return (
            value,
            (inverse - weighted_residuals[:, :, None] * weighted_residuals[:, None, :]) / r.test_weights[:, None, None],
            noise_model,
        )

    def _derivative(self, G: Floats, noise_model: NoiseModel, output: str, name: str) -> float:
        """tr(G dC / d ln size) / 2."""
        r = self.residuals
        if name in ("discrepancy", "discrepancy_length"):
            assert r.discrepancy_unit is not None
            unit = noise_model.discrepancy * r.discrepancy_unit
            weighted = G * np.exp(-self.time_lags / noise_model.discrepancy_length) * self.same_output
            if name == "discrepancy":
                return float(np.einsum("ti,tij,tj->", unit, weighted, unit))
            return (
                0.5
                * float(np.einsum("ti,tij,tj->", unit, weighted * self.time_lags, unit))
                / (noise_model.discrepancy_length)
            )
        if not output:
            d = r.log_rate_sensitivity
            return noise_model.rate**2 * float(np.einsum("ti,tij,tj->", d, G, d))
        components, mask = noise_model[output], r.present & (r.output_index == self.names.index(output))
        if name == "noise":
            noise_variance = (components.noise * r.relative_noise * r.offset_sensitivity) ** 2
            return float((np.einsum("tii->ti", G) * noise_variance)[mask].sum())
        if name == "misfit":
            return components.misfit**2 * float(np.einsum("tii->ti", G)[mask].sum())
        if name == "offset":
            s = np.where(mask, r.offset_sensitivity, 0.0)
            return components.offset**2 * float(np.einsum("ti,tij,tj->", s, G, s))
        correlation = np.exp(-self.time_lags / components.correlation_length) * (self.same_output & mask[:, :, None])
        if name == "drift":
            return components.drift**2 * float((G * correlation).sum())
        return (
            0.5 * components.drift**2 * float((G * correlation * self.time_lags).sum()) / components.correlation_length
        )


def _component(noise_model: NoiseModel, output: str, name: str) -> float:
    return float(getattr(noise_model[output] if output else noise_model, name))


def _bounds(residuals: Residuals, noise_model: NoiseModel, output: str, name: str) -> tuple[float, float]:
    """Bounds of the logarithm of a component: an offset up to the typical output itself."""
    if name == "rate":
        return float(np.log(1e-4)), float(np.log(LARGEST_RATE_SCATTER))
    if name == "discrepancy_length":
        return float(np.log(SHORTEST_DISCREPANCY)), float(np.log(LONGEST_CORRELATION))
    if name == "discrepancy":
        return float(np.log(1e-2)), float(np.log(LARGEST_DISCREPANCY))
    if name == "noise":
        measured, stated = noise_model[output].noise, noise_model[output].stated
        lowest = stated if stated > 0 else SMALLEST_NOISE_RATIO * measured
        return float(np.log(lowest)), float(np.log(LARGEST_NOISE_RATIO * max(measured, lowest)))
    if name != "offset":
        return float(np.log(1e-4)), float(np.log(5.0))
    mask = residuals.present & (residuals.output_index == list(noise_model.outputs).index(output))
    typical_output = float(np.median(1.0 / np.maximum(residuals.offset_sensitivity[mask], 1e-12)))
    return float(np.log(1e-5 * typical_output)), float(np.log(typical_output))
