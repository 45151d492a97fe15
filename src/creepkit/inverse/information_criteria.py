"""Information criteria: BIC, AICc, weights of laws, and the laws that they cannot rule out.

BIC is the deviance + K ln n, AICc the deviance + 2K + 2K(K+1)/(n-K-1), with K parameters that the data determine and n
independent observations. Weights are exp(-excess / 2) over their sum.
"""

from __future__ import annotations

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.inverse.noise_model import Residuals

DECISIVE_WEIGHT = 0.95
"""Weight above which one law is decided for."""


CREDIBLE_WEIGHT = 0.05
"""Weight above which a law is not ruled out."""


def bic_penalty(parameters: int, observations: float) -> float:
    """K ln n."""
    return parameters * float(np.log(observations))


def aicc_penalty(parameters: int, observations: float) -> float:
    """2K + 2K(K+1)/(n-K-1)."""
    return 2.0 * parameters + 2.0 * parameters * (parameters + 1) / max(observations - parameters - 1.0, 1.0)


def criterion_weights(scores: ArrayLike) -> tuple[Floats, Floats]:
    """Excess of criteria over the least of them, and their weights: (laws,) - each, of scores (laws,)."""
    values = np.asarray(scores, float)
    excess = values - values.min()
    weight = np.exp(-0.5 * excess)
    return excess, weight / weight.sum()


def determined_parameters(residuals: Residuals, parameters: int) -> int:
    """How many of the first `parameters` unknowns change any residual of the data."""
    assert residuals.jacobian is not None
    return int((residuals.jacobian[residuals.present][:, :parameters] != 0).any(axis=0).sum())
