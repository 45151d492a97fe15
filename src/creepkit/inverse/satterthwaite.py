"""Intervals of a restricted likelihood: their covariance, and the freedom that estimated scatter leaves them.

The variance v of a parameter is a function of the sizes of scatter, which are uncertain themselves, with the expected
information I of the restricted likelihood. Matching two moments of v gives the freedom 2 v^2 / (g' I^-1 g), g the
gradient of v (Satterthwaite (1946), Biometrics Bull. 2, 110; Kenward & Roger (1997), Biometrics 53, 983).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.covariance import covariance
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.restricted import Linear, Solved, inverse, inverses_of
from creepkit.inverse.scatter import Scatter, given_sizes
from creepkit.inverse.weighting import ABSENT
from creepkit.records import Nuisance

STEP = 1e-3
"""Of the logarithm of a size, for differences of the covariance, which is smooth in it."""
LEAST_FREEDOM = 3.0
"""Below this a quantile says nothing but that the scatter is unknown."""


def restricted_laplace(
    linear: Linear, scatter: Scatter, nuisances: Sequence[Nuisance], stated: Collection[tuple[str, str]] = ()
) -> tuple[Floats, float]:
    """Posterior covariance of x = (u, e), (unknowns, unknowns), and its degrees of freedom.

    stated : (output, source) of sizes that are known beside those that nuisances give.
    Unknowns at their bounds count here as all others: their intervals reach inwards.
    """
    everything = replace(linear, free=np.ones_like(linear.free))
    inverses, _ = inverses_of(linear.residuals, scatter)
    solved = everything.solved(inverses)
    sizes = [size for size in _estimated(scatter, nuisances) if size not in stated]
    if not sizes:
        return solved.variance, 1e9
    slopes = [_change(linear.residuals, scatter, *one) for one in sizes]
    pulled = [np.einsum("tep,tef,tfq->pq", solved.pulled, s, solved.pulled, optimize=True) for s in slopes]
    information = _information(solved, inverses, slopes, pulled)
    gradient = np.stack([np.diag(solved.variance @ p @ solved.variance) for p in pulled], axis=1)
    spread = inverse(information + 1e-9 * np.diag(np.diag(information)) + 1e-12 * np.eye(len(sizes)))
    of_variance = np.einsum("pj,jk,pk->p", gradient, spread, gradient)
    freedom = 2.0 * np.diag(solved.variance) ** 2 / np.maximum(of_variance, 1e-300)
    touched = (everything.jacobian != 0).any(axis=(0, 1))
    return solved.variance, float(np.clip(np.median(freedom[touched]), LEAST_FREEDOM, 1e9))


def _information(solved: Solved, inverses: Floats, slopes: Sequence[Floats], pulled: Sequence[Floats]) -> Floats:
    """I_ij = tr(Q C_i Q C_j) / 2 with Q = C^-1 - B M B', B = C^-1 J: the values that tests share tie them together.

    slopes : C_i of every test; pulled : B' C_i B.
    """
    moved = [inverses @ slope for slope in slopes]
    left = [np.einsum("tep,tef->tpf", solved.pulled, slope, optimize=True) for slope in slopes]
    right = [a @ solved.pulled for a in moved]
    shared = [solved.variance @ own for own in pulled]
    information = np.empty((len(slopes), len(slopes)))
    for i, j in np.ndindex(information.shape):
        alone = np.einsum("tef,tfe->", moved[i], moved[j])
        both = np.einsum("pq,tqe,tep->", solved.variance, left[j], right[i], optimize=True)
        information[i, j] = 0.5 * float(alone - 2.0 * both + np.trace(shared[i] @ shared[j]))
    return information


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
