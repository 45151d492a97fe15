"""Marginal likelihood of log rupture times: right-censored run-outs, random effects of heats and laboratories.

log10 of the time of a test is m + b + s e, with m by the method, b the sum of the effects of its heat and laboratory,
each normal with mean 0, and e standard normal ("lognormal" times) or of the smallest extreme value ("weibull" times). A
test that broke contributes its density, a run-out the probability that it lasts longer (Tobin (1958), Econometrica 26,
24).

Effects are integrated out. With one kind of effect by adaptive Gauss-Hermite quadrature about the mode of each effect
(Liu, Pierce (1994), Biometrika 81, 624), with two by Laplace's approximation about their joint mode. Both are exact, to
rounding, for lognormal times without run-outs: there the integrand is Gaussian.

All functions take several candidates at once, so that derivatives by differences cost one call.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import log_ndtr, logsumexp

from creepkit.arrays import Bools, Floats, Ints

Distribution = Literal["lognormal", "weibull"]

DISTRIBUTIONS: tuple[Distribution, ...] = ("lognormal", "weibull")

NODES = 15
"""Of Gauss-Hermite quadrature."""

NEWTON_STEPS = 30
"""To the mode of the effects: far more than a concave function needs."""

LARGEST_STEP = 4.0
"""Of an effect in one Newton step, in scales: e^z is steep."""

LEAST_SCATTER = 1e-9
"""Standard deviation of an effect that is none, log10 of time."""

HALF_LOG_TAU = 0.5 * float(np.log(2.0 * np.pi))


@dataclass(frozen=True, eq=False)
class GroupedTimes:
    """Observed log times and which effects they share.

    log_time, censored : (tests,). members : one matrix (tests, levels) of zeros and ones for each kind of effect.
    """

    log_time: Floats
    censored: Bools
    members: tuple[Floats, ...]
    distribution: Distribution

    @classmethod
    def of(
        cls, log_time: Floats, censored: Bools, groups: Mapping[str, Sequence[str]], distribution: Distribution
    ) -> GroupedTimes:
        """With the groups by name, in their order."""
        members = []
        for values in groups.values():
            levels = sorted(set(values))
            members.append(np.array([[float(v == level) for level in levels] for v in values]))
        return cls(log_time, censored, tuple(members), distribution)

    def log_likelihood(self, mean: Floats, scale: Floats, scatter: Floats) -> Floats:
        """(candidates,) marginal log-likelihoods.

        mean : (candidates, tests). scale : (candidates,). scatter : (candidates, kinds of effects), of either sign.
        """
        scale = np.abs(scale)
        if not self.members:
            return np.asarray(self._terms(mean, scale[:, None])[0].sum(axis=-1))
        scatter = np.maximum(np.abs(scatter), LEAST_SCATTER)
        return (
            self._by_quadrature(mean, scale, scatter[:, 0])
            if len(self.members) == 1
            else self._by_laplace(mean, scale, scatter)
        )

    def _terms(self, mean: Floats, scale: Floats) -> tuple[Floats, Floats, Floats]:
        """Log-density, or log-probability to last, and its first two derivatives by the mean; (..., tests) each."""
        z = (self.log_time - mean) / scale
        if self.distribution == "weibull":
            growth = np.exp(np.minimum(z, 300.0))
            broken = ~self.censored
            value = np.where(broken, z - np.log(scale), 0.0) - growth
            return value, (growth - broken) / scale, -growth / scale**2
        lasting = log_ndtr(-z)
        exponent = np.minimum(-0.5 * z**2 - HALF_LOG_TAU - lasting, 700.0)
        hazard = np.minimum(np.exp(exponent), np.maximum(z, 0.0) + 1.0)  # of which it never has more: rounding
        value = np.where(self.censored, lasting, -0.5 * z**2 - HALF_LOG_TAU - np.log(scale))
        first = np.where(self.censored, hazard, z) / scale
        second = -np.where(self.censored, hazard * (hazard - z), 1.0) / scale**2
        return value, first, second

    def _modes(self, mean: Floats, scale: Floats, scatter: Floats, members: Floats) -> tuple[Floats, Floats]:
        """Joint mode of effects (candidates, levels), and the negative Hessian there (candidates, levels, levels).

        scatter : (candidates, levels).
        """
        effects = np.zeros(scatter.shape)
        precision = scatter**-2.0
        limit = LARGEST_STEP * scale[:, None]
        first_level, second_level, order, starts = _shared_tests(members)
        for _ in range(NEWTON_STEPS):
            _, first, second = self._terms(mean + effects @ members.T, scale[:, None])
            hessian = precision[:, :, None] * np.eye(scatter.shape[1])
            hessian[:, first_level, second_level] -= np.add.reduceat(second[:, order], starts, axis=1)
            gradient = first @ members - precision * effects
            step = np.clip(np.linalg.solve(hessian, gradient[..., None])[..., 0], -limit, limit)
            effects = effects + step
            if (np.abs(step) <= 1e-12 * scale[:, None]).all():
                break
        return effects, hessian

    def _by_quadrature(self, mean: Floats, scale: Floats, scatter: Floats) -> Floats:
        members = self.members[0]
        effects = np.zeros((scale.size, members.shape[1]))
        precision, limit = scatter[:, None] ** -2.0, LARGEST_STEP * scale[:, None]
        for _ in range(NEWTON_STEPS):  # levels share no test, so each has a Newton iteration of its own
            _, first, second = self._terms(mean + effects @ members.T, scale[:, None])
            curvature = precision - second @ members
            step = np.clip((first @ members - precision * effects) / curvature, -limit, limit)
            effects = effects + step
            if (np.abs(step) <= 1e-12 * scale[:, None]).all():
                break
        nodes, weights = np.polynomial.hermite.hermgauss(NODES)
        width = np.sqrt(2.0 / curvature)
        points = effects[:, None, :] + nodes[:, None] * width[:, None, :]
        terms = self._terms(mean[:, None, :] + points @ members.T, scale[:, None, None])[0] @ members
        exponents = terms - 0.5 * precision[:, None, :] * points**2 + (np.log(weights) + nodes**2)[:, None]
        by_level = logsumexp(exponents, axis=1) + np.log(width) - HALF_LOG_TAU - np.log(scatter)[:, None]
        return np.asarray(by_level.sum(axis=1))

    def _by_laplace(self, mean: Floats, scale: Floats, scatter: Floats) -> Floats:
        members = np.column_stack(self.members)
        spread = np.repeat(scatter, [m.shape[1] for m in self.members], axis=1)
        effects, hessian = self._modes(mean, scale, spread, members)
        value = self._terms(mean + effects @ members.T, scale[:, None])[0].sum(axis=-1)
        value = value - (0.5 * (effects / spread) ** 2 + np.log(spread)).sum(axis=-1)
        return np.asarray(value - 0.5 * np.linalg.slogdet(hessian)[1])

    def effects(self, mean: Floats, scale: float, scatter: Floats) -> list[Floats]:
        """Modes of the effects given the estimates: (levels,) for each kind.

        mean : (tests,). scatter : (kinds,).
        """
        if not self.members:
            return []
        sizes = [m.shape[1] for m in self.members]
        spread = np.repeat(np.maximum(np.abs(scatter), LEAST_SCATTER)[None], sizes, axis=1)
        modes, _ = self._modes(mean[None], np.array([scale]), spread, np.column_stack(self.members))
        return np.split(modes[0], np.cumsum(sizes)[:-1])


def _shared_tests(members: Floats) -> tuple[Ints, Ints, Ints, Ints]:
    """Pairs of levels (pairs,) (pairs,) that share tests; those tests, pair after pair, and where each pair's begin.

    members : (tests, levels) of zeros and ones. A product of matrices would take all pairs, of which few share a test.
    """
    levels = [np.flatnonzero(row) for row in members]
    triples = np.array([(i, j, test) for test, own in enumerate(levels) for i in own for j in own])
    triples = triples[np.lexsort(triples.T[::-1])]
    new = np.any(np.diff(triples[:, :2], axis=0) != 0, axis=1)
    starts = np.concatenate([[0], np.flatnonzero(new) + 1])
    return triples[starts, 0], triples[starts, 1], triples[:, 2], starts
