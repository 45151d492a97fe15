"""An identification reopened for intervals: under the scatter that its own intervals assume."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from creepkit.inverse.covariance import whitener
from creepkit.inverse.identification import Identification
from creepkit.inverse.problem import Opened, reopened
from creepkit.inverse.scatter import FEW_TESTS


def opened(fit: Identification) -> Opened:
    """The problem of a fit about its optimum, with the scatter of the rate as its Laplace intervals have it.

    That scatter, found by maximum likelihood from T tests beside K parameters, is too small by a factor of
    T / (T - K) in variance (see inverse.uncertainty); restricted likelihood, and a given scatter, are not.
    """
    problem, tests = reopened(fit), len(fit.histories)
    given = tests < FEW_TESTS or any(n.kind == "rate" and n.sd is not None for n in fit.settings.nuisances)
    if given or fit.settings.weights == "likelihood" or fit.scatter.rate == 0:
        return problem
    jacobian = problem.residuals.jacobian
    assert jacobian is not None
    touched = int((jacobian[..., : fit.u.size] != 0).any(axis=(0, 1)).sum())
    rate = fit.scatter.rate * float(np.sqrt(tests / max(tests - max(touched, 1), 1)))
    scatter = replace(fit.scatter, rate=rate)
    return replace(problem, scatter=scatter, factor=whitener(problem.residuals, scatter))
