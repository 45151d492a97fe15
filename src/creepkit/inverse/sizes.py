"""The sizes of scatter of largest marginal likelihood, with its exact gradient.

A first-order mixed-effects model: Pinheiro & Bates (2000), Mixed-Effects Models in S and S-PLUS, ch. 7. With
G = C^-1 - C^-1 r r' C^-1 the derivative of -ln L to any size is tr(G dC) / 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from creepkit.arrays import Floats
from creepkit.inverse.covariance import company, lags
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.restricted import Linear, inverses_of
from creepkit.inverse.scatter import Scatter, given_sizes
from creepkit.records import Nuisance

LONGEST = 3.0
"""Longest reach of the drift on its clock, a factor 20 in time or .6 of a test: what lasts longer is scatter of the
rate."""
LEAST_NOISE, MOST_NOISE = 0.1, 30.0
"""Of the noise that was stated or read off neighbouring frames: where an estimate of it may go."""
LOST = float(np.log(30.0))
"""A source that falls by more than this may have been overshot, to where the likelihood no longer feels it: from half
way the search is made again."""
SOURCES = ("noise", "misfit", "offset", "drift", "reach")


def estimated(
    residuals: Residuals, start: Scatter, nuisances: Sequence[Nuisance], *, fixed: Sequence[str] = ("noise",),
    linear: Linear | None = None,
) -> Scatter:  # fmt: skip
    """The scatter of largest likelihood, beginning from `start`.

    Sources at zero, named in `fixed` or with a given prior stay; the noise, which was measured, unless told otherwise.
    linear : with it the likelihood is the restricted one, values of the law integrated out.
    """
    given = given_sizes(nuisances, list(start.outputs))
    free = [
        (o, n) for n in SOURCES for o, sizes in start.outputs.items()
        if getattr(sizes, n) > 0 and (o, n) not in given and n not in fixed and (n != "reach" or sizes.drift > 0)
    ]  # fmt: skip
    free += [("", "rate")] if start.rate > 0 and ("", "rate") not in given else []
    if not free:
        return start
    likelihood = _Likelihood(residuals, start, free, linear)
    bounds = [_bounds(residuals, start, output, name) for output, name in free]
    x0 = np.array([np.clip(np.log(_size(start, *one)), *b) for one, b in zip(free, bounds, strict=True)])
    best = _least(likelihood, x0, bounds)
    lost = best.x < x0 - LOST
    if lost.any() and linear is None:
        best = min(best, _least(likelihood, np.where(lost, x0 - 0.5 * LOST, best.x), bounds), key=lambda end: end.fun)
    return likelihood.scatter(best.x)


def _least(likelihood: _Likelihood, x0: Floats, bounds: Sequence[tuple[float, float]]) -> OptimizeResult:
    inside = np.clip(x0, [low for low, _ in bounds], [high for _, high in bounds])
    options = {"maxiter": 60, "ftol": 1e-9 if likelihood.linear is None else 1e-7}
    return minimize(likelihood.cost, inside, jac=True, method="L-BFGS-B", bounds=bounds, options=options)


class _Likelihood:
    """-ln L, but for a constant, as a function of the logarithms of some sizes."""

    def __init__(
        self, residuals: Residuals, start: Scatter, free: Sequence[tuple[str, str]], linear: Linear | None = None
    ) -> None:
        self.residuals, self.start, self.free, self.linear = residuals, start, free, linear
        self.names, self.lags = list(start.outputs), lags(residuals)
        present = residuals.present[:, :, None] & residuals.present[:, None, :]
        self.company = company(residuals) & present

    def scatter(self, x: Floats) -> Scatter:
        """The scatter with these logarithms of the free sizes."""
        found = self.start
        for (output, name), value in zip(self.free, np.exp(x), strict=True):
            found = replace(found, rate=float(value)) if not output else found.changed(output, **{name: float(value)})
        return found

    def cost(self, x: Floats) -> tuple[float, Floats]:
        """Value and gradient."""
        value, slope, scatter = self.gradient(x)
        return value, np.array([self._slope(slope, scatter, output, name) for output, name in self.free])

    def gradient(self, x: Floats) -> tuple[float, Floats, Scatter]:
        """-ln L, G of every test, and the scatter."""
        r, scatter = self.residuals, self.scatter(x)
        inverse, log_det = inverses_of(r, scatter)
        if self.linear is None:
            pulled = (inverse @ r.values[..., None])[..., 0]
            value = 0.5 * (float((r.values * pulled).sum()) + log_det)
        else:
            solved = self.linear.solved(inverse)
            pulled = solved.white
            value = 0.5 * (log_det + solved.log_det + solved.chi_square)
            inverse = inverse - solved.pulled @ solved.variance @ np.swapaxes(solved.pulled, 1, 2)
        return value, (inverse - pulled[:, :, None] * pulled[:, None, :]) / r.trust[:, None, None], scatter

    def _slope(self, G: Floats, scatter: Scatter, output: str, name: str) -> float:
        """tr(G dC / d ln size) / 2."""
        r = self.residuals
        if not output:
            d = r.rate_effect
            return scatter.rate**2 * float(np.einsum("ti,tij,tj->", d, G, d))
        sizes, mine = scatter[output], r.present & (r.output == self.names.index(output))
        if name == "noise":
            own = (sizes.noise * r.loudness * r.slopes) ** 2
            return float((np.einsum("tii->ti", G) * own)[mine].sum())
        if name == "misfit":
            return sizes.misfit**2 * float(np.einsum("tii->ti", G)[mine].sum())
        if name == "offset":
            s = np.where(mine, r.slopes, 0.0)
            return sizes.offset**2 * float(np.einsum("ti,tij,tj->", s, G, s))
        kept = np.exp(-self.lags / sizes.reach) * (self.company & mine[:, :, None])
        if name == "drift":
            return sizes.drift**2 * float((G * kept).sum())
        return 0.5 * sizes.drift**2 * float((G * kept * self.lags).sum()) / sizes.reach


def _size(scatter: Scatter, output: str, name: str) -> float:
    return scatter.rate if not output else float(getattr(scatter[output], name))


def _bounds(residuals: Residuals, scatter: Scatter, output: str, name: str) -> tuple[float, float]:
    """Logarithms of what a size may be: an offset up to the typical output itself."""
    if name == "reach":
        return float(np.log(0.05)), float(np.log(LONGEST))
    if name == "noise":
        stated = scatter[output].noise
        return float(np.log(LEAST_NOISE * stated)), float(np.log(MOST_NOISE * stated))
    if name != "offset":
        return float(np.log(1e-4)), float(np.log(5.0))
    mine = residuals.present & (residuals.output == list(scatter.outputs).index(output))
    typical = float(np.median(1.0 / np.maximum(residuals.slopes[mine], 1e-12)))
    return float(np.log(1e-5 * typical)), float(np.log(typical))
