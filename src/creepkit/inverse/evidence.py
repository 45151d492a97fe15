"""Evidence for laws, their weights, and the laws that it cannot rule out.

By Laplace's method, -2 ln of the evidence for a law is

    chi-square + ln|C| + ln det(1 + S J' C^-1 J S)

with J the derivatives of the residuals to its unknowns, C their covariance, and S the prior standard deviations: of a
parameter those of its bounds, width / 12^(1/2), of a nuisance parameter its own (MacKay (1992), Neural Comput. 4, 415).
A parameter costs 2 ln of the factor by which the tests narrow it: nothing where they say nothing of it, little where
tests differ from one another by more than readings do, and as much as BIC's ln n where n readings alike tell it.
"""

from __future__ import annotations

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.variance_components import LinearisedProblem

DECISIVE_WEIGHT = 0.95
"""Weight above which one law is decided for."""


CREDIBLE_WEIGHT = 0.05
"""Weight above which a law is not ruled out."""


DECISIVE_EXCESS = 2.0 * float(np.log(DECISIVE_WEIGHT / (1.0 - DECISIVE_WEIGHT)))
"""-2 ln of the evidence over that of another law from which on this one has the decisive weight of the two."""


def evidence_weights(scores: ArrayLike) -> tuple[Floats, Floats]:
    """Excess over the least, and weights: (laws,) - each, of scores (laws,), -2 ln of the evidence."""
    values = np.asarray(scores, float)
    excess = values - values.min()
    weight = np.exp(-0.5 * excess)
    return excess, weight / weight.sum()


def occam_penalty(linearised: LinearisedProblem, factor: CovarianceFactor) -> float:
    """ln det(1 + S J' C^-1 J S): what the unknowns of a law cost."""
    residuals = linearised.residuals
    sd = np.minimum(linearised.prior_sd, np.diff(linearised.step_bounds, axis=0)[0] / np.sqrt(12.0))
    white = factor.whiten(residuals.jacobian * sd)[residuals.present]
    return float(np.linalg.slogdet(np.eye(sd.size) + white.T @ white)[1])
