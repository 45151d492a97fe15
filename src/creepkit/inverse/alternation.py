"""Values given the scatter, scatter given the values, in turn until the likelihood no longer grows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.covariance import log_likelihood, whitener
from creepkit.inverse.effects import Unknowns
from creepkit.inverse.objective import Objective
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.scatter import Scatter
from creepkit.inverse.search import Box, Minimum, Progress, refine
from creepkit.inverse.uncertainty import curvature, inverse, marginal
from creepkit.inverse.weighting import Weighting, pulling, trusts

SPREAD_STEPS = 30
"""Steps of the estimate of unknown spreads in each round; they cost no simulation."""
SETTLED = 0.02
"""Gain of the log-likelihood, and change of a test's weight, that ends the rounds."""


@dataclass(frozen=True)
class Effort:
    """How long to refine: rounds, and steps of least squares with their tolerance in each."""

    rounds: int = 8
    steps: int = 40
    tolerance: float = 1e-8


EXPENSIVE = Effort(rounds=5, steps=25, tolerance=1e-6)
"""For predictors with a stand-in: solvers are smooth to about that."""


@dataclass(frozen=True)
class Fitted:
    """Where values and working scatter agree: the optimum, its residuals, spreads of unknowns, and the likelihood."""

    minimum: Minimum
    residuals: Residuals
    working: Scatter
    unknowns: Unknowns
    likelihood: float


def alternate(
    objective: Objective, box: Box, x: Floats, weighting: Weighting, effort: Effort, progress: Progress | None
) -> Fitted:
    """Refine from x = (u, e); the best round."""
    robust = weighting.settings.test_loss == "student"
    residuals, working, best = objective.at(x), weighting.guess(), None
    for k in range(effort.rounds):
        before = residuals.trust
        trust = trusts(residuals, working) if robust else before
        residuals = residuals.trusting(trust)
        working = weighting.working(residuals, working)
        # A stopped test that says nothing here may say something a step further.
        everything = replace(residuals, present=objective.entries.present)
        factor = whitener(everything, pulling(working, objective.entries))
        minimum = refine(
            objective, box, factor, x, loss=weighting.settings.loss, steps=effort.steps, tolerance=effort.tolerance
        )
        x = minimum.u
        residuals = objective.at(x).trusting(trust)
        now = _fitted(objective, minimum, residuals, working)
        objective.unknowns = now.unknowns
        if progress is not None:
            progress("round", k + 1, effort.rounds)
        gain = np.inf if best is None else now.likelihood - best.likelihood
        best = now if best is None or gain > 0 or robust else best
        if abs(gain) < SETTLED and np.abs(trust - before).max() < SETTLED:
            break
    assert best is not None
    objective.unknowns = best.unknowns
    return best


def _fitted(objective: Objective, minimum: Minimum, residuals: Residuals, working: Scatter) -> Fitted:
    """The round's end, with the spreads of unknowns that its residuals show."""
    unknowns, likelihood = objective.unknowns, log_likelihood(residuals, working)
    if not unknowns.size:
        return Fitted(minimum, residuals, working, unknowns, likelihood)
    curve = curvature(residuals, working)
    unknowns = _with_spreads(unknowns, curve, minimum.u)
    e = minimum.u[-unknowns.size :]
    return Fitted(minimum, residuals, working, unknowns, marginal(likelihood, curve, e, unknowns))


def _with_spreads(unknowns: Unknowns, curve: Floats, x: Floats) -> Unknowns:
    """Expectation and maximisation in turn, on the problem made linear at its optimum x.

    At the optimum the pull of the data is that of the prior, P (x - mean); with another P the linear problem moves x
    to where both agree again.
    """
    if all(n.sd is not None for n in unknowns.nuisances):
        return unknowns
    own = unknowns.size
    pull = np.zeros(x.size)
    pull[-own:] = unknowns.precision * (x[-own:] - unknowns.mean)
    for _ in range(SPREAD_STEPS):
        prior = np.zeros(x.size)
        prior[-own:] = unknowns.precision
        variance = inverse(curve + np.diag(prior + 1e-12 * np.diag(curve)))
        target = np.zeros(x.size)
        target[-own:] = prior[-own:] * (unknowns.mean - x[-own:])
        e = (x + variance @ (pull + target))[-own:]
        unknowns = unknowns.with_spread(e, np.diag(variance)[-own:])
    return unknowns


def free(unknowns: Unknowns, u: Floats, known: Mapping[tuple[str, str], float]) -> Floats:
    """x = (u, e) with the unknowns of tests where they are known, {(kind, member): value}, else at their means."""
    owners = zip(unknowns.nuisances, unknowns.members, unknowns.mean, strict=True)
    return np.concatenate([u, [known.get((n.kind, member), float(mean)) for n, member, mean in owners]])
