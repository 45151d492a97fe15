"""The noise model and the covariance at the end of an estimation, from its likelihood or by the delta method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from creepkit.arrays import Floats
from creepkit.inverse.iterative_estimation import EstimationResult
from creepkit.inverse.noise_model import ASSUMED_RATE_SD, MINIMUM_TESTS, NoiseModel, initial_noise_model
from creepkit.inverse.uncertainty.laplace_approximation import laplace_covariance, restricted_covariance
from creepkit.inverse.variance_components import estimate_variance_components
from creepkit.inverse.working_noise import WorkingNoiseEstimator, with_single_value_weight
from creepkit.records import Nuisance


def uncertainty_of(
    best: EstimationResult, working_estimator: WorkingNoiseEstimator, tests: int
) -> tuple[NoiseModel, Floats, float]:
    """The noise model, the posterior covariance of x = (u, e), (unknowns, unknowns), and its degrees of freedom."""
    problem, x = best.problem, best.minimum.x
    settings = problem.settings
    if best.linearised is not None:
        fixed = working_estimator.unestimated_drift_components(best.working_noise)
        return best.working_noise, *restricted_covariance(
            best.linearised, best.working_noise, settings.nuisances, fixed, problem.parameter_count
        )
    nuisances = _with_assumed_rate(settings.nuisances, tests)
    at_prior_means = problem.nuisance_parameters.integrate_out(best.residuals, x[problem.parameter_count :])
    noise_model = estimate_variance_components(
        at_prior_means,
        initial_noise_model(working_estimator.with_measured_noise(best.working_noise), nuisances),
        nuisances,
    )
    rate_is_given = any(n.kind == "rate" and n.sd is not None for n in nuisances)
    fitting_noise = with_single_value_weight(best.working_noise, problem.observations)
    return noise_model, *laplace_covariance(
        best.residuals,
        fitting_noise,
        noise_model,
        problem.bounds,
        problem.nuisance_parameters,
        rate_known=rate_is_given,
    )


def _with_assumed_rate(nuisances: Sequence[Nuisance], tests: int) -> tuple[Nuisance, ...]:
    """The nuisances, with the scatter between tests assumed where too few tests could show it."""
    if tests >= MINIMUM_TESTS:
        return tuple(nuisances)
    return tuple(replace(n, sd=ASSUMED_RATE_SD) if n.kind == "rate" and n.sd is None else n for n in nuisances)
