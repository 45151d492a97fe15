"""The sizes of scatter of largest marginal likelihood, with its exact gradient.

A first-order mixed-effects model: Pinheiro & Bates (2000), Mixed-Effects Models in S and S-PLUS, ch. 7. With
G = C^-1 - C^-1 r r' C^-1 the derivative of -ln L to any size is tr(G dC) / 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from creepkit.arrays import Floats
from creepkit.inverse.covariance import same_output, time_lags
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.restricted import LinearisedProblem, inverse_covariances
from creepkit.inverse.scatter import NoiseModel, fixed_components
from creepkit.records import Nuisance

LONGEST_CORRELATION = 3.0
"""Longest reach of the drift on its clock, a factor 20 in time or .6 of a test: what lasts longer is scatter of the
rate."""
SMALLEST_NOISE_RATIO, LARGEST_NOISE_RATIO = 0.1, 30.0
"""Of the noise that was stated or read off neighbouring frames: where an estimate of it may go."""
OVERSHOOT = float(np.log(30.0))
"""A source that falls by more than this may have been overshot, to where the likelihood no longer feels it: from half
way the search is made again."""
COMPONENTS = ("noise", "misfit", "offset", "drift", "reach")


def estimate_variance_components(
    residuals: Residuals, start: NoiseModel, nuisances: Sequence[Nuisance], *, fixed: Sequence[str] = ("noise",),
    linearised: LinearisedProblem | None = None,
) -> NoiseModel:  # fmt: skip
    """The scatter of largest likelihood, beginning from `start`.

    Sources at zero, named in `fixed` or with a given prior stay; the noise, which was measured, unless told otherwise.
    linear : with it the likelihood is the restricted one, values of the law integrated out.
    """
    fixed_by_prior = fixed_components(nuisances, list(start.outputs))
    free = [
        (o, n) for n in COMPONENTS for o, components in start.outputs.items()
        if getattr(components, n) > 0 and (o, n) not in fixed_by_prior and n not in fixed and (n != "reach" or components.drift > 0)
    ]  # fmt: skip
    free += [("", "rate")] if start.rate > 0 and ("", "rate") not in fixed_by_prior else []
    if not free:
        return start
    likelihood = _Likelihood(residuals, start, free, linearised)
    bounds = [_bounds(residuals, start, output, name) for output, name in free]
    x0 = np.array([np.clip(np.log(_component(start, *component)), *b) for component, b in zip(free, bounds, strict=True)])
    optimum = _minimised(likelihood, x0, bounds)
    overshot = optimum.x < x0 - OVERSHOOT
    if overshot.any() and linearised is None:
        optimum = min(optimum, _minimised(likelihood, np.where(overshot, x0 - 0.5 * OVERSHOOT, optimum.x), bounds), key=lambda end: end.fun)
    return likelihood.noise_model(optimum.x)


def _minimised(likelihood: _Likelihood, x0: Floats, bounds: Sequence[tuple[float, float]]) -> OptimizeResult:
    inside = np.clip(x0, [low for low, _ in bounds], [high for _, high in bounds])
    options = {"maxiter": 60, "ftol": 1e-9 if likelihood.linear is None else 1e-7}
    return minimize(likelihood.cost, inside, jac=True, method="L-BFGS-B", bounds=bounds, options=options)


class _Likelihood:
    """-ln L, but for a constant, as a function of the logarithms of some sizes."""

    def __init__(
        self, residuals: Residuals, start: NoiseModel, free: Sequence[tuple[str, str]], linearised: LinearisedProblem | None = None
    ) -> None:
        self.residuals, self.start, self.free, self.linear = residuals, start, free, linearised
        self.names, self.time_lags = list(start.outputs), time_lags(residuals)
        present = residuals.present[:, :, None] & residuals.present[:, None, :]
        self.same_output = same_output(residuals) & present

    def noise_model(self, x: Floats) -> NoiseModel:
        """The scatter with these logarithms of the free sizes."""
        noise_model = self.start
        for (output, name), value in zip(self.free, np.exp(x), strict=True):
            noise_model = replace(noise_model, rate=float(value)) if not output else noise_model.with_output(output, **{name: float(value)})
        return noise_model

    def cost(self, x: Floats) -> tuple[float, Floats]:
        """Value and gradient."""
        value, projected, noise_model = self.gradient(x)
        return value, np.array([self._derivative(projected, noise_model, output, name) for output, name in self.free])

    def gradient(self, x: Floats) -> tuple[float, Floats, NoiseModel]:
        """-ln L, G of every test, and the scatter."""
        r, noise_model = self.residuals, self.noise_model(x)
        inverse, log_det = inverse_covariances(r, noise_model)
        if self.linear is None:
            weighted_residuals = (inverse @ r.values[..., None])[..., 0]
            value = 0.5 * (float((r.values * weighted_residuals).sum()) + log_det)
        else:
            solved = self.linear.solve(inverse)
            weighted_residuals = solved.weighted_residuals
            value = 0.5 * (log_det + solved.log_det + solved.chi_square)
            inverse = inverse - solved.weighted_jacobian @ solved.covariance @ np.swapaxes(solved.weighted_jacobian, 1, 2)
        return value, (inverse - weighted_residuals[:, :, None] * weighted_residuals[:, None, :]) / r.test_weights[:, None, None], noise_model

    def _derivative(self, G: Floats, noise_model: NoiseModel, output: str, name: str) -> float:
        """tr(G dC / d ln size) / 2."""
        r = self.residuals
        if not output:
            d = r.log_rate_sensitivity
            return noise_model.rate**2 * float(np.einsum("ti,tij,tj->", d, G, d))
        components, mask = noise_model[output], r.present & (r.output_index == self.names.index(output))
        if name == "noise":
            noise_variance = (components.noise * r.relative_noise * r.transform_derivatives) ** 2
            return float((np.einsum("tii->ti", G) * noise_variance)[mask].sum())
        if name == "misfit":
            return components.misfit**2 * float(np.einsum("tii->ti", G)[mask].sum())
        if name == "offset":
            s = np.where(mask, r.transform_derivatives, 0.0)
            return components.offset**2 * float(np.einsum("ti,tij,tj->", s, G, s))
        correlation = np.exp(-self.time_lags / components.correlation_length) * (self.same_output & mask[:, :, None])
        if name == "drift":
            return components.drift**2 * float((G * correlation).sum())
        return 0.5 * components.drift**2 * float((G * correlation * self.time_lags).sum()) / components.correlation_length


def _component(noise_model: NoiseModel, output: str, name: str) -> float:
    return noise_model.rate if not output else float(getattr(noise_model[output], name))


def _bounds(residuals: Residuals, noise_model: NoiseModel, output: str, name: str) -> tuple[float, float]:
    """Logarithms of what a size may be: an offset up to the typical output itself."""
    if name == "reach":
        return float(np.log(0.05)), float(np.log(LONGEST_CORRELATION))
    if name == "noise":
        stated = noise_model[output].noise
        return float(np.log(SMALLEST_NOISE_RATIO * stated)), float(np.log(LARGEST_NOISE_RATIO * stated))
    if name != "offset":
        return float(np.log(1e-4)), float(np.log(5.0))
    mask = residuals.present & (residuals.output_index == list(noise_model.outputs).index(output))
    typical_output = float(np.median(1.0 / np.maximum(residuals.transform_derivatives[mask], 1e-12)))
    return float(np.log(1e-5 * typical_output)), float(np.log(typical_output))
