"""Identifications by likelihood, judged under one covariance: that of the law which explains the histories best.

With a covariance of its own each law would excuse what it cannot follow: as drift, as a rate of the test's own where it
predicts that rates matter more, as a test of little trust. The problems are linear about their
optima, so that no simulation is needed to move each law to its optimum under the common covariance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.covariance import effective_sample_size
from creepkit.inverse.identification import Identification
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.restricted import LinearisedProblem, inverse_covariances
from creepkit.inverse.weighting import NEGLIGIBLE_DRIFT


@dataclass(frozen=True, eq=False)
class CommonCovarianceFits:
    """Chi-squares of laws under one covariance, (laws,), with priors; evidence of nuisances; independent frames.

    chosen : position of the law whose covariance it is; white : (laws, entries) residuals over that scatter, zero
        where there are no data, or where a law has nothing to say of a test that was stopped.
    """

    chi_square: Floats
    log_determinant: Floats
    independent_frames: float
    reference_law: int
    whitened: Floats


def under_common_covariance(fits: Sequence[Identification]) -> CommonCovarianceFits:
    """All laws under the covariance of the one that explains best with its own."""
    linearised = [_linearised(fit) for fit in fits]
    own_scores = [_score_under_own_covariance(fit, linear) for fit, linear in zip(fits, linearised, strict=True)]
    reference_law = int(np.argmin(own_scores))
    noise_model, reference_residuals = fits[reference_law].noise_model, linearised[reference_law].residuals
    results = [
        _optimum_under(linear, inverse_covariances(_with_covariance_of(reference_residuals, linear.residuals), noise_model)[0], len(identification.u))
        for linear, identification in zip(linearised, fits, strict=True)
    ]
    independent_frames = effective_sample_size(reference_residuals, noise_model)
    chi_squares, log_determinants, whitened = zip(*results, strict=True)
    return CommonCovarianceFits(np.array(chi_squares), np.array(log_determinants), independent_frames, reference_law, np.array(whitened))


def _with_covariance_of(reference: Residuals, residuals: Residuals) -> Residuals:
    """A law's residuals with what makes the covariance, but for which entries it speaks of, as the best law has it."""
    transform_derivatives, rate_effect = (
        np.where(reference.present, reference_values, own_values)
        for reference_values, own_values in ((reference.transform_derivatives, residuals.transform_derivatives), (reference.log_rate_sensitivity, residuals.log_rate_sensitivity))
    )
    return replace(residuals, transform_derivatives=transform_derivatives, log_rate_sensitivity=rate_effect, test_weights=reference.test_weights)


def _linearised(fit: Identification) -> LinearisedProblem:
    assert fit.linearised is not None
    return fit.linearised


def _score_under_own_covariance(fit: Identification, linearised: LinearisedProblem) -> float:
    """-2 ln L with the law's own scatter, and BIC's price of its parameters and of the sizes of that scatter.

    A law that needs a drift for what another follows must not set the measure.
    """
    inverses, log_det = inverse_covariances(linearised.residuals, fit.noise_model)
    independent_frames = effective_sample_size(linearised.residuals, fit.noise_model)
    parameter_count = len(fit.u) + sum(1 + 2 * (components.drift > NEGLIGIBLE_DRIFT) for components in fit.noise_model.outputs.values())
    return log_det + _optimum_under(linearised, inverses, len(fit.u))[0] + parameter_count * float(np.log(independent_frames))


def _optimum_under(linearised: LinearisedProblem, inverses: Floats, parameter_count: int) -> tuple[float, float, Floats]:
    """Chi-square with priors at the optimum within the bounds, ln of what nuisances cost, and white residuals.

    Only unknowns of tests have priors here: the weak ones of a law's parameters must not favour the middle of bounds.
    """
    precision = linearised.precision.copy()
    precision[:parameter_count] = 1e-9 * precision[:parameter_count]
    without_parameter_priors = replace(linearised, precision=precision)
    newton_step = np.zeros(precision.size)
    newton_step[linearised.free] = without_parameter_priors.solve(inverses).step
    newton_step = np.clip(newton_step, *linearised.step_bounds)
    best = min((_chi_square(without_parameter_priors, inverses, candidate_step) for candidate_step in (newton_step, np.zeros_like(newton_step))), key=lambda pair: pair[0])
    return best[0], _nuisance_log_determinant(linearised, inverses, parameter_count), best[1]


def _chi_square(linearised: LinearisedProblem, inverses: Floats, step: Floats) -> tuple[float, Floats]:
    residuals = linearised.residuals
    assert residuals.jacobian is not None
    remaining = residuals.values + residuals.jacobian @ step
    prior_deviation = linearised.prior_residual + step
    total = np.einsum("te,tef,tf->", remaining, inverses, remaining) + (linearised.precision * prior_deviation**2).sum()
    factor = np.linalg.cholesky(inverses)
    whitened = (np.swapaxes(factor, 1, 2) @ remaining[..., None])[..., 0]
    return float(total), np.where(residuals.present, whitened, 0.0).ravel()


def _nuisance_log_determinant(linearised: LinearisedProblem, inverses: Floats, parameter_count: int) -> float:
    """ln det(1 + S J'C^-1 J S) of the unknowns of tests, S their prior spreads: they are integrated out."""
    assert linearised.residuals.jacobian is not None
    jacobian = linearised.residuals.jacobian[..., parameter_count:]
    if not jacobian.shape[-1]:
        return 0.0
    sd = 1.0 / np.sqrt(np.maximum(linearised.precision[parameter_count:], 1e-300))
    sd = np.minimum(sd, np.diff(linearised.step_bounds, axis=0)[0, parameter_count:] / np.sqrt(12.0))
    information = np.einsum("tep,tef,tfq->pq", jacobian, inverses, jacobian, optimize=True) * np.outer(sd, sd)
    return float(np.linalg.slogdet(information + np.eye(len(sd)))[1])
