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
from creepkit.inverse.covariance import effective_size
from creepkit.inverse.identification import Identification
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.restricted import Linear, inverses_of
from creepkit.inverse.weighting import ABSENT


@dataclass(frozen=True, eq=False)
class Judged:
    """Chi-squares of laws under one covariance, (laws,), with priors; evidence of nuisances; independent frames.

    chosen : position of the law whose covariance it is; white : (laws, entries) residuals over that scatter, zero
        where there are no data, or where a law has nothing to say of a test that was stopped.
    """

    chi_square: Floats
    occam: Floats
    size: float
    chosen: int
    white: Floats


def judged(fits: Sequence[Identification]) -> Judged:
    """All laws under the covariance of the one that explains best with its own."""
    linears = [_linear(fit) for fit in fits]
    own = [_own_score(fit, linear) for fit, linear in zip(fits, linears, strict=True)]
    chosen = int(np.argmin(own))
    scatter, best = fits[chosen].scatter, linears[chosen].residuals
    found = [
        _under(linear, inverses_of(_scattering_as(best, linear.residuals), scatter)[0], len(f.u))
        for linear, f in zip(linears, fits, strict=True)
    ]
    size = effective_size(best, scatter)
    chi2, occam, white = zip(*found, strict=True)
    return Judged(np.array(chi2), np.array(occam), size, chosen, np.array(white))


def _scattering_as(best: Residuals, own: Residuals) -> Residuals:
    """A law's residuals with what makes the covariance, but for which entries it speaks of, as the best law has it."""
    slopes, effect = (
        np.where(best.present, mine, other)
        for mine, other in ((best.slopes, own.slopes), (best.rate_effect, own.rate_effect))
    )
    return replace(own, slopes=slopes, rate_effect=effect, trust=best.trust)


def _linear(fit: Identification) -> Linear:
    assert fit.linear is not None
    return fit.linear


def _own_score(fit: Identification, linear: Linear) -> float:
    """-2 ln L with the law's own scatter, and BIC's price of its parameters and of the sizes of that scatter.

    A law that needs a drift for what another follows must not set the measure.
    """
    inverses, log_det = inverses_of(linear.residuals, fit.scatter)
    size = effective_size(linear.residuals, fit.scatter)
    sizes = len(fit.u) + sum(1 + 2 * (s.drift > ABSENT) for s in fit.scatter.outputs.values())
    return log_det + _under(linear, inverses, len(fit.u))[0] + sizes * float(np.log(size))


def _under(linear: Linear, inverses: Floats, count: int) -> tuple[float, float, Floats]:
    """Chi-square with priors at the optimum within the bounds, ln of what nuisances cost, and white residuals.

    Only unknowns of tests have priors here: the weak ones of a law's parameters must not favour the middle of bounds.
    """
    precision = linear.precision.copy()
    precision[:count] = 1e-9 * precision[:count]
    flat = replace(linear, precision=precision)
    move = np.zeros(precision.size)
    move[linear.free] = flat.solved(inverses).move
    move = np.clip(move, *linear.room)
    best = min((_chi_square(flat, inverses, step) for step in (move, np.zeros_like(move))), key=lambda pair: pair[0])
    return best[0], _occam(linear, inverses, count), best[1]


def _chi_square(linear: Linear, inverses: Floats, move: Floats) -> tuple[float, Floats]:
    r = linear.residuals
    assert r.jacobian is not None
    left = r.values + r.jacobian @ move
    from_means = linear.distance + move
    total = np.einsum("te,tef,tf->", left, inverses, left) + (linear.precision * from_means**2).sum()
    factor = np.linalg.cholesky(inverses)
    white = (np.swapaxes(factor, 1, 2) @ left[..., None])[..., 0]
    return float(total), np.where(r.present, white, 0.0).ravel()


def _occam(linear: Linear, inverses: Floats, count: int) -> float:
    """ln det(1 + S J'C^-1 J S) of the unknowns of tests, S their prior spreads: they are integrated out."""
    assert linear.residuals.jacobian is not None
    J = linear.residuals.jacobian[..., count:]
    if not J.shape[-1]:
        return 0.0
    sd = 1.0 / np.sqrt(np.maximum(linear.precision[count:], 1e-300))
    sd = np.minimum(sd, np.diff(linear.room, axis=0)[0, count:] / np.sqrt(12.0))
    own = np.einsum("tep,tef,tfq->pq", J, inverses, J, optimize=True) * np.outer(sd, sd)
    return float(np.linalg.slogdet(own + np.eye(len(sd)))[1])
