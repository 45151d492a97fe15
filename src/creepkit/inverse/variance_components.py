"""Variance components by maximum likelihood and by restricted maximum likelihood (REML), with exact gradients."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import OptimizeResult, lsq_linear, minimize

from creepkit.arrays import Bools, Floats
from creepkit.inverse.noise_covariance import CovarianceFactor, NoiseLikelihood
from creepkit.inverse.noise_model import OUTPUT_COMPONENTS, NoiseModel, Residuals, known_sd
from creepkit.inverse.nuisance_parameters import Perturbation
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT
from creepkit.records import Nuisance

BOUND_TOLERANCE = 1e-6
"""Of the width of the bounds: an unknown nearer to its bound than this is fixed there."""


@dataclass(frozen=True, eq=False)
class LinearisedProblem:
    """A problem made linear where its residuals were taken.

    residuals : with their derivatives to all unknowns. precision, prior_residual : (unknowns,) of the priors, and the
    distance from their means. free : (unknowns,) which are not at their bounds. step_bounds : (2, unknowns) least and
    largest step within the bounds. x : (unknowns,) where it was made linear.
    """

    residuals: Residuals
    precision: Floats
    prior_residual: Floats
    free: Bools
    step_bounds: Floats
    x: Floats = field(default_factory=lambda: np.zeros(0))

    @property
    def jacobian(self) -> Floats:
        """(tests, observations, free unknowns) derivatives of the residuals."""
        return self.residuals.jacobian[..., self.free]

    def of(self, unknowns: Sequence[int]) -> LinearisedProblem:
        """The same of some of the unknowns, the others held."""
        residuals, kept = self.residuals, [*unknowns]
        return LinearisedProblem(
            replace(residuals, jacobian=residuals.jacobian[..., kept]),
            self.precision[kept],
            self.prior_residual[kept],
            self.free[kept],
            self.step_bounds[:, kept],
            self.x[kept],
        )

    def with_effects(self, effects: Iterable[Perturbation]) -> LinearisedProblem:
        """The same with perturbations in the covariance: of each test by itself, or of all tests alike."""
        own, common = list[Floats](), list[Floats]()
        for effect in effects:
            (common if effect.common else own).append(effect.residual_change)
        return replace(self, residuals=self.residuals.with_effects(own, common))

    def with_errors(self, errors: Iterable[Perturbation]) -> LinearisedProblem:
        """The same with those errors of tests in its covariance that intervals include."""
        return self.with_effects(one for one in errors if one.included)

    def solve(self, factor: CovarianceFactor) -> LinearSolution:
        """The optimum under a covariance."""
        J, p = self.jacobian, self.precision[self.free]
        weighted = factor.inverse_times(np.concatenate([self.residuals.values[..., None], J], axis=-1))
        normal_matrix = np.einsum("tep,teq->pq", J, weighted[..., 1:]) + np.diag(p)
        covariance = scaled_inverse(normal_matrix)
        prior_residual = self.prior_residual.copy()
        step = -covariance @ (np.einsum("tep,te->p", J, weighted[..., 0]) + p * prior_residual[self.free])
        prior_residual[self.free] += step
        residuals = self.residuals.values + J @ step
        weighted_residuals = factor.inverse_times(residuals)
        chi2 = float((residuals * weighted_residuals).sum() + (self.precision * prior_residual**2).sum())
        log_det = -float(np.linalg.slogdet(covariance)[1])
        return LinearSolution(step, residuals, weighted_residuals, weighted[..., 1:], covariance, chi2, log_det)

    @property
    def prior_sd(self) -> Floats:
        """(unknowns,) standard deviations of the priors."""
        return np.asarray(1.0 / np.sqrt(np.maximum(self.precision, 1e-300)))

    @property
    def whole(self) -> LinearisedProblem:
        """The same with all unknowns free."""
        return replace(self, free=np.ones_like(self.free))

    def chi_square(self, factor: CovarianceFactor, step: Floats | float = 0.0) -> tuple[float, Floats]:
        """Of residuals and priors after a step (unknowns,), and the whitened residuals (tests, observations)."""
        residuals = self.residuals
        whitened = factor.whiten(residuals.values + residuals.jacobian @ np.broadcast_to(step, self.precision.shape))
        prior = self.precision * (self.prior_residual + step) ** 2
        return float((whitened**2).sum() + prior.sum()), whitened

    def step_within(self, factor: CovarianceFactor) -> Floats:
        """(free unknowns,) the step to the optimum within the bounds, or none where it gains nothing."""
        whitened = factor.whiten(np.concatenate([self.jacobian, self.residuals.values[..., None]], axis=-1))
        root_prior = np.sqrt(self.precision[self.free])
        rows = np.column_stack([np.diag(root_prior), root_prior * self.prior_residual[self.free]])
        rows = np.concatenate([whitened[self.residuals.present], rows])
        low, high = self.step_bounds[:, self.free]
        step = least_within(rows, np.minimum(low, 0.0), np.maximum(high, 0.0))
        gains = np.linalg.norm(rows[:, :-1] @ step + rows[:, -1]) < np.linalg.norm(rows[:, -1])
        return step if gains else np.zeros_like(step)


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


def least_within(rows: Floats, low: Floats, high: Floats) -> Floats:
    """(unknowns,) step of least squares within bounds.

    rows : (rows, unknowns + 1) derivatives, then values. low, high : (unknowns,) of the step.
    """
    step, moves = np.zeros(low.size), high > low
    size = np.maximum(np.linalg.norm(rows[:, :-1], axis=0), 1e-150)[moves]
    matrix, low, high = rows[:, :-1][:, moves] / size, low[moves] * size, high[moves] * size
    best = np.linalg.lstsq(matrix, -rows[:, -1], rcond=1e-12)[0]
    if ((best < low) | (best > high)).any():
        best = np.clip(lsq_linear(matrix, -rows[:, -1], (low, high), method="bvls", tol=1e-12).x, low, high)
    step[moves] = best / size
    return step


def restricted_log_likelihood(
    linearised: LinearisedProblem, noise_model: NoiseModel, integrated: Bools | None = None
) -> float:
    """ln L but for a constant; ln|A| over all unknowns, so that it does not jump where one meets its bound.

    integrated : (unknowns,) those that are integrated out, where these are not all.
    """
    integrated = np.ones_like(linearised.free) if integrated is None else integrated
    factor, free = CovarianceFactor.of_residuals(linearised.residuals, noise_model), linearised.free & integrated
    solution = replace(linearised, free=free).solve(factor)
    unconstrained = solution
    if (free != integrated).any():
        unconstrained = replace(linearised, free=integrated).solve(factor)
    priors = float(np.log(linearised.precision[linearised.precision > 0]).sum())
    return -0.5 * (factor.log_determinant + unconstrained.log_det - priors + solution.chi_square)


def log_noise_prior(noise_model: NoiseModel) -> float:
    """ln of the prior of the white noise of outputs whose noise is stated, but for a constant."""
    stated = [components for components in noise_model.outputs.values() if components.stated > 0]
    return -0.5 * sum((float(np.log(s.noise / s.stated)) / NOISE_PRIOR_SD) ** 2 for s in stated)


def scaled_inverse(matrix: Floats) -> Floats:
    """Inverses (..., n, n) of positive definite matrices whose rows differ by orders of magnitude.

    matrix : (..., n, n).
    """
    scale = np.sqrt(np.diagonal(matrix, axis1=-2, axis2=-1))
    squares = scale[..., :, None] * scale[..., None, :]
    return np.asarray(np.linalg.inv(matrix / squares) / squares)


LONGEST_CORRELATION = 3.0
"""Longest correlation of a discrepancy, a factor 20 in time or 0.6 of a test: what lasts longer is scatter of the rate.
"""


LONGEST_DRIFT = 0.5
"""Longest correlation of the noise of an instrument, a tenth of a test: what lasts longer is a model discrepancy."""


SHORTEST_CORRELATION, SHORTEST_DISCREPANCY = 0.05, 0.25
"""Shortest correlations of an instrument's noise and of a discrepancy: a hundredth and a twentieth of a test."""


SMALLEST_RATE_SCATTER = 1e-4
"""Of ln rate between tests, where an estimate of none ends."""


SMALLEST_LIFE_SCATTER = 1e-5
"""Of ln rate of damage, less: near rupture a life shows as exactly as time is read."""


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


BOUNDS = {
    "rate": (SMALLEST_RATE_SCATTER, LARGEST_RATE_SCATTER),
    "life": (SMALLEST_LIFE_SCATTER, LARGEST_RATE_SCATTER),
    "discrepancy": (1e-2, LARGEST_DISCREPANCY),
    "discrepancy_length": (SHORTEST_DISCREPANCY, LONGEST_CORRELATION),
    "correlation_length": (SHORTEST_CORRELATION, LONGEST_DRIFT),
}
"""Of components that have the same ones whatever the data."""


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
    free = [
        (o, n)
        for n in OUTPUT_COMPONENTS
        for o, components in start.outputs.items()
        if getattr(components, n) > 0
        and not (n == "offset" and known_sd(nuisances, n, o))
        and n not in fixed
        and (n != "correlation_length" or components.drift > 0)
    ]
    free += [("", "rate")] if start.rate > 0 and not known_sd(nuisances, "rate") else []
    free += [("", "life")] if start.life > 0 else []
    free += [("", "discrepancy"), ("", "discrepancy_length")] if start.discrepancy > 0 else []
    if not free:
        return start
    likelihood = _Likelihood(residuals, start, free, linearised)
    bounds = [_bounds(residuals, start, output, name, longest_drift) for output, name in free]
    x0 = np.clip(np.log(likelihood.components[likelihood.positions]), *np.transpose(bounds))
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
    options = {"maxiter": 60, "ftol": 1e-9}
    return minimize(likelihood.cost, inside, jac=True, method="L-BFGS-B", bounds=bounds, options=options)


class _Likelihood:
    """-ln L, but for a constant, as a function of the logarithms of some components."""

    def __init__(
        self,
        residuals: Residuals,
        start: NoiseModel,
        free: Sequence[tuple[str, str]],
        linear: LinearisedProblem | None = None,
    ) -> None:
        self.start, self.components = start, start.components
        self.positions = [start.position(*component) for component in free]
        stated = [start[output].stated if name == "noise" else 0.0 for output, name in free]
        self.has_prior = np.array(stated) > 0
        self.log_stated = np.log(np.where(self.has_prior, stated, 1.0))
        self.fixed_cost = 0.0
        values, precision, prior_residual = residuals.values[..., None], np.zeros(0), np.zeros(0)
        if linear is not None:
            values = np.concatenate([linear.residuals.values[..., None], linear.jacobian], axis=-1)
            precision, prior_residual = linear.precision[linear.free], linear.prior_residual[linear.free]
            self.fixed_cost = 0.5 * float((linear.precision * linear.prior_residual**2)[~linear.free].sum())
        self.likelihood = NoiseLikelihood(residuals.series, values, precision, prior_residual, self.components)

    def components_at(self, x: Floats) -> Floats:
        """Those of a noise model with these logarithms of the free components, (components,)."""
        components = self.components.copy()
        components[self.positions] = np.exp(x)
        return components

    def noise_model(self, x: Floats) -> NoiseModel:
        """The noise model with these logarithms of the free components, (components,)."""
        return self.start.with_components(self.components_at(x))

    def cost(self, x: Floats) -> tuple[float, Floats]:
        """Value and gradient."""
        value, gradient = self.likelihood(self.components_at(x))
        excess = np.where(self.has_prior, x - self.log_stated, 0.0) / NOISE_PRIOR_SD
        return (
            value + self.fixed_cost + 0.5 * float((excess**2).sum()),
            gradient[self.positions] + excess / NOISE_PRIOR_SD,
        )


def _bounds(
    residuals: Residuals, noise_model: NoiseModel, output: str, name: str, longest_drift: float
) -> tuple[float, float]:
    """Bounds of the logarithm of a component: an offset up to the typical output itself, lives as far as ends lie."""
    low, high = BOUNDS.get(name, (1e-4, 5.0))
    if name == "correlation_length":
        high = longest_drift
    elif name == "life":
        high = max(_scatter_of_ends(residuals, noise_model, high), 2.0 * low)
    elif name == "noise":
        measured, stated = noise_model[output].noise, noise_model[output].stated
        low = stated if stated > 0 else SMALLEST_NOISE_RATIO * measured
        high = LARGEST_NOISE_RATIO * max(measured, low)
    elif name == "offset":
        mask = residuals.present & (residuals.output_index == list(noise_model.outputs).index(output))
        high = float(np.median(1.0 / np.maximum(residuals.offset_sensitivity[mask], 1e-12)))
        low = 1e-5 * high
    return float(np.log(low)), float(np.log(high))


def _scatter_of_ends(residuals: Residuals, noise_model: NoiseModel, unknown: float) -> float:
    """Root mean square by which rupture times of tests that broke miss the law, in ln; `unknown` where none is known.

    The damage of curves by a law of another shape scatters by more, with rates against it, and says nothing of lives.
    """
    if RUPTURE_OUTPUT not in noise_model.outputs:
        return unknown
    broke = residuals.present & (residuals.output_index == list(noise_model.outputs).index(RUPTURE_OUTPUT))
    if residuals.stopped.sd is not None:
        broke &= residuals.stopped.shift == 0.0
    return float(np.sqrt(np.mean(residuals.values[broke] ** 2))) if broke.any() else unknown
