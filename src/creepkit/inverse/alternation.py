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
from creepkit.inverse.restricted import AT_BOUND, Linear, inverse, inverses_of, restricted_log_likelihood
from creepkit.inverse.scatter import Scatter
from creepkit.inverse.search.box import Box
from creepkit.inverse.search.refining import Minimum, Progress, refine
from creepkit.inverse.uncertainty import curvature, marginal
from creepkit.inverse.weighting import Weighting, pulling, trusts

SPREAD_STEPS = 30
"""Steps of the estimate of unknown spreads in each round; they cost no simulation."""
RESTRICTED = 1e-5
"""Relative change of a chi-square that ends a refinement by likelihood: some thousandth of one, well inside an interval
and above what the steps of a solver leave."""
SETTLED = 0.02
"""Gain of the log-likelihood, and change of a test's weight, that ends the rounds."""


@dataclass(frozen=True)
class Effort:
    """How long to refine: rounds, and steps of least squares with their tolerance in each."""

    rounds: int = 8
    steps: int = 40
    tolerance: float = 1e-8


SKETCH = Effort(rounds=3, steps=15, tolerance=1e-4)
"""For a predictor on the way to another."""
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
    linear: Linear | None = None


def alternate(
    objective: Objective, box: Box, x: Floats, weighting: Weighting, effort: Effort, progress: Progress | None,
    working: Scatter | None = None,
) -> Fitted:  # fmt: skip
    """Refine from x = (u, e); the best round. working : where the scatter begins, if it is known already."""
    robust, best = weighting.settings.test_loss == "student", None
    residuals, working = objective.at(x), working or weighting.start(len(objective.histories))
    for k in range(effort.rounds):
        before = residuals.trust
        trust = trusts(residuals, working) if robust else before
        residuals = residuals.trusting(trust)
        working = weighting.working(residuals, working, linearised(objective, box, x, residuals))
        # A stopped test that says nothing here may say something a step further.
        everything = replace(residuals, present=objective.entries.present)
        if best is not None and weighting.likelihood and _gain(objective, box, x, residuals, working) < SETTLED:
            break
        pull = working if weighting.likelihood else pulling(working, objective.entries)
        factor = whitener(everything, pull)
        tolerance = max(effort.tolerance, RESTRICTED) if weighting.likelihood else effort.tolerance
        minimum = refine(
            objective, box, factor, x, loss=weighting.settings.loss, steps=effort.steps, tolerance=tolerance
        )
        x = minimum.u
        residuals = objective.at(x).trusting(trust)
        now = _fitted(objective, box, minimum, residuals, working, weighting.likelihood)
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


def _gain(objective: Objective, box: Box, x: Floats, residuals: Residuals, working: Scatter) -> float:
    """By how much the log-likelihood of values would grow, to first order, if they moved to where the scatter asks."""
    linear = linearised(objective, box, x, residuals)
    inverses, _ = inverses_of(residuals, working)
    now = np.einsum("te,tef,tf->", residuals.values, inverses, residuals.values)
    now += (linear.precision * linear.distance**2).sum()
    return 0.5 * float(now - linear.solved(inverses).chi_square)


def linearised(objective: Objective, box: Box, x: Floats, residuals: Residuals) -> Linear:
    """The problem made linear at x = (u, e): weak priors of the bounds on u, their own on e."""
    own = x.size - objective.unknowns.size
    precision = np.concatenate([12.0 / box.width[:own] ** 2, objective.unknowns.precision])
    distance = np.concatenate([np.zeros(own), x[own:] - objective.unknowns.mean[: x.size - own]])
    room = AT_BOUND * box.width
    free = (x > box.low + room) & (x < box.high - room)
    return Linear(residuals, precision, distance, free, np.stack([box.low - x, box.high - x]))


def _fitted(
    objective: Objective, box: Box, minimum: Minimum, residuals: Residuals, working: Scatter, restricted: bool
) -> Fitted:
    """The round's end, with the spreads of unknowns that its residuals show."""
    if restricted:
        objective.unknowns = _shown(objective.unknowns, residuals, working, minimum.u)
        linear = linearised(objective, box, minimum.u, residuals)
        likelihood = restricted_log_likelihood(linear, working)
        return Fitted(minimum, residuals, working, objective.unknowns, likelihood, linear)
    unknowns, likelihood = objective.unknowns, log_likelihood(residuals, working)
    if not unknowns.size:
        return Fitted(minimum, residuals, working, unknowns, likelihood)
    curve = curvature(residuals, working)
    unknowns = _shown(unknowns, residuals, working, minimum.u)
    e = minimum.u[-unknowns.size :]
    return Fitted(minimum, residuals, working, unknowns, marginal(likelihood, curve, e, unknowns))


def _shown(unknowns: Unknowns, residuals: Residuals, working: Scatter, x: Floats) -> Unknowns:
    """The unknowns with those of their spreads estimated that are to be."""
    if all(n.sd is not None for n in unknowns.nuisances):
        return unknowns
    return _with_spreads(unknowns, curvature(residuals, working), x)


def _with_spreads(unknowns: Unknowns, curve: Floats, x: Floats) -> Unknowns:
    """Expectation and maximisation in turn, on the problem made linear at its optimum x.

    At the optimum the pull of the data is that of the prior, P (x - mean); with another P the linear problem moves x
    to where both agree again.
    """
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
