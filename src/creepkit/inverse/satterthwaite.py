"""Intervals of a restricted likelihood: their covariance, and the freedom that estimated scatter leaves them.

The variance v of a parameter is a function of the sizes of scatter, which are uncertain themselves, with the expected
information I of the restricted likelihood. Matching two moments of v gives the freedom 2 v^2 / (g' I^-1 g), g the
gradient of v (Satterthwaite (1946), Biometrics Bull. 2, 110; Kenward & Roger (1997), Biometrics 53, 983).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.covariance import covariance
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.restricted import Linear, inverse, inverses_of
from creepkit.inverse.scatter import Scatter, given_sizes
from creepkit.inverse.weighting import ABSENT
from creepkit.records import Nuisance

STEP = 1e-3
"""Of the logarithm of a size, for differences of the covariance, which is smooth in it."""
LEAST_FREEDOM = 3.0
"""Below this a quantile says nothing but that the scatter is unknown."""


def restricted_laplace(linear: Linear, scatter: Scatter, nuisances: Sequence[Nuisance]) -> tuple[Floats, float]:
    """Posterior covariance of x = (u, e), (unknowns, unknowns), and its degrees of freedom.

    Unknowns at their bounds count here as all others: their intervals reach inwards.
    """
    everything = replace(linear, free=np.ones_like(linear.free))
    inverses, _ = inverses_of(linear.residuals, scatter)
    solved = everything.solved(inverses)
    sizes = _estimated(scatter, nuisances)
    if not sizes:
        return solved.variance, 1e9
    slopes = [_change(linear.residuals, scatter, *one) for one in sizes]
    projected = inverses - solved.pulled @ solved.variance @ np.swapaxes(solved.pulled, 1, 2)
    moved = [projected @ slope for slope in slopes]
    information = np.array([[0.5 * float(np.einsum("tij,tji->", a, b)) for a in moved] for b in moved])
    pulled = [np.einsum("tep,tef,tfq->pq", solved.pulled, s, solved.pulled, optimize=True) for s in slopes]
    gradient = np.stack([np.diag(solved.variance @ p @ solved.variance) for p in pulled], axis=1)
    spread = inverse(information + 1e-9 * np.diag(np.diag(information)) + 1e-12 * np.eye(len(sizes)))
    of_variance = np.einsum("pj,jk,pk->p", gradient, spread, gradient)
    freedom = 2.0 * np.diag(solved.variance) ** 2 / np.maximum(of_variance, 1e-300)
    touched = (everything.jacobian != 0).any(axis=(0, 1))
    return solved.variance, float(np.clip(np.median(freedom[touched]), LEAST_FREEDOM, 1e9))


def _estimated(scatter: Scatter, nuisances: Sequence[Nuisance]) -> list[tuple[str, str]]:
    """(output, source) of the sizes that the data were asked for; "" for the rate."""
    given = given_sizes(nuisances, list(scatter.outputs))
    found = []
    for output, sizes in scatter.outputs.items():
        names = ["noise"] + ["misfit"] * (sizes.misfit > 0) + ["offset"] * (sizes.offset > 0)
        names += ["drift", "reach"] * (sizes.drift > ABSENT)
        found += [(output, name) for name in names if (output, name) not in given]
    return found + ([("", "rate")] if scatter.rate > 0 and ("", "rate") not in given else [])


def _change(residuals: Residuals, scatter: Scatter, output: str, name: str) -> Floats:
    """Derivative of the covariances to the logarithm of one size, (tests, entries, entries)."""

    def at(shift: float) -> Floats:
        factor = float(np.exp(shift))
        if not output:
            return covariance(residuals, replace(scatter, rate=scatter.rate * factor))
        return covariance(residuals, scatter.changed(output, **{name: getattr(scatter[output], name) * factor}))

    return np.asarray((at(STEP) - at(-STEP)) / (2.0 * STEP))
