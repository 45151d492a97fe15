"""An identification reopened for intervals: under the scatter that its own intervals assume."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from creepkit.inverse.covariance import cholesky_factors
from creepkit.inverse.identification import Identification
from creepkit.inverse.problem import LeastSquaresProblem, least_squares_problem
from creepkit.inverse.scatter import MINIMUM_TESTS


def interval_problem(fit: Identification) -> LeastSquaresProblem:
    """The problem of a fit about its optimum, with the scatter of the rate as its Laplace intervals have it.

    That scatter, found by maximum likelihood from T tests beside K parameters, is too small by a factor of
    T / (T - K) in variance (see inverse.uncertainty); restricted likelihood, and a given scatter, are not.
    """
    problem, test_count = least_squares_problem(fit), len(fit.histories)
    is_rate_given = test_count < MINIMUM_TESTS or any(n.kind == "rate" and n.sd is not None for n in fit.settings.nuisances)
    if is_rate_given or fit.settings.weights == "likelihood" or fit.noise_model.rate == 0:
        return problem
    jacobian = problem.residuals.jacobian
    assert jacobian is not None
    determined_count = int((jacobian[..., : fit.u.size] != 0).any(axis=(0, 1)).sum())
    rate_scatter = fit.noise_model.rate * float(np.sqrt(test_count / max(test_count - max(determined_count, 1), 1)))
    noise_model = replace(fit.noise_model, rate=rate_scatter)
    return replace(problem, noise_model=noise_model, covariance_factor=cholesky_factors(problem.residuals, noise_model))
