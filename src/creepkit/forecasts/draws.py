"""Draws from what an identification leaves uncertain of a new test: the law, the test's own rate, its dimensions.

The law's unknowns and the tests' ln factors are drawn together, from the posterior distribution of the scatter between
tests (see inverse.uncertainty.rate_scatter). A heat or laboratory among those that were fitted keeps its own factor: a
draw from the prior is conditioned on what the tests showed by kriging its difference to them (Matheron's rule).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import FitError, nearest
from creepkit.inverse.composite_predictor import predictor_for, supports_nuisance
from creepkit.inverse.identification import Identification
from creepkit.inverse.nuisance_parameters import owner_of, prior_mean
from creepkit.inverse.uncertainty.rate_scatter import LEVELS, USUAL_SD, RateScatter, level_of
from creepkit.records import SIMULATED_NUISANCES, STEP_NUISANCES, History, Nuisance, Predictor

TOLERANCE_KINDS = tuple(kind for kind in SIMULATED_NUISANCES if kind not in STEP_NUISANCES)
"""Kinds of nuisance parameters that a tolerance can be given of."""


SOURCES = {
    "test": "scatter between tests",
    "heat": "scatter between heats",
    "laboratory": "scatter between laboratories",
}
"""What the scatter of each level is called among the parts of a band."""


MOST_BATCHES = 50
"""Of draws, until enough of them lie within the bounds of the law; then some are taken more than once."""


BOUND_TOLERANCE = 1e-6
"""Of the width of the bounds: draws as near as this outside one count as inside."""


@dataclass(frozen=True, eq=False)
class LawDraws:
    """Draws of the unknowns of one identification, with the scatter that each of them belongs to.

    unknowns : (draws, unknowns) x = (u, e). scatter_sd : (draws, levels) of ln rate. members : {level: (draws,
    members)} ln factors of the members of the levels that were fitted.
    """

    fit: Identification
    unknowns: Floats
    scatter_sd: Floats
    members: Mapping[str, Floats]

    @property
    def count(self) -> int:
        """Number of draws."""
        return len(self.unknowns)

    @property
    def u(self) -> Floats:
        """(draws, parameters) conditioned coordinates of the law."""
        return self.unknowns[:, : self.fit.u.size]


def law_draws(fit: Identification, count: int, rng: np.random.Generator) -> LawDraws:
    """`count` draws of the unknowns of an identification and of the factors of its heats and laboratories.

    Draws outside the bounds of the law are drawn again: moved to a bound one by one, parameters that compensate each
    other would no longer do so.
    """
    drawn = [_joint_draws(fit, count, rng)]
    while sum(one.count for one in drawn) < count and len(drawn) < MOST_BATCHES:
        drawn.append(_joint_draws(fit, count, rng))
    if not any(one.count for one in drawn):
        drawn = [_joint_draws(fit, count, rng, within_bounds=False)]
    chosen = np.arange(count) % sum(one.count for one in drawn)
    return LawDraws(
        fit,
        np.concatenate([one.unknowns for one in drawn])[chosen],
        np.concatenate([one.scatter_sd for one in drawn])[chosen],
        {level: np.concatenate([one.members[level] for one in drawn])[chosen] for level in drawn[0].members},
    )


def _joint_draws(fit: Identification, count: int, rng: np.random.Generator, *, within_bounds: bool = True) -> LawDraws:
    """Draws of all that is uncertain together, at most `count`: those within the bounds of the law."""
    scatter = fit.scatter_of_rates
    posterior = scatter.posterior
    nodes = rng.permutation(_systematic(posterior.weight, count, rng))
    sd = posterior.sd[nodes]
    effects = {
        level: sd[:, [k]] * rng.standard_normal((count, scatter.indicators[level].shape[1]))
        for k, level in enumerate(scatter.levels)
    }
    factors = sum(effects[level] @ scatter.indicators[level].T for level in scatter.levels)
    errors = (
        factors @ scatter.gain.T + rng.standard_normal((count, len(scatter.within))) @ covariance_root(scatter.within).T
    )
    unknowns = fit.x - errors
    members = {}
    if scatter.members:
        shown = factors - errors @ scatter.design.T
        shown = shown + np.sqrt(scatter.variance) * rng.standard_normal(shown.shape)
        members = _conditioned(scatter, sd, nodes, effects, shown)
    kept = np.ones(count, bool)
    if within_bounds:
        theta = fit.coordinates.theta(unknowns[:, : fit.u.size])
        low, high = fit.law.internal_bounds
        margin = BOUND_TOLERANCE * (high - low)
        kept = ((theta >= low - margin) & (theta <= high + margin)).all(axis=1)
    return LawDraws(fit, unknowns[kept], sd[kept], {level: values[kept] for level, values in members.items()})


def _systematic(weight: Floats, count: int, rng: np.random.Generator) -> Ints:
    """(count,) positions drawn with probabilities `weight`, as evenly as these allow."""
    points = (np.arange(count) + rng.random()) / count
    return np.minimum(np.searchsorted(np.cumsum(weight), points), weight.size - 1)


def covariance_root(covariance: Floats) -> Floats:
    """A square root (unknowns, unknowns) of covariance (unknowns, unknowns)."""
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    return np.asarray(scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))


def _conditioned(
    scatter: RateScatter, sd: Floats, nodes: Ints, effects: Mapping[str, Floats], shown: Floats
) -> dict[str, Floats]:
    """{level: (draws, members)} effects given what the tests showed.

    shown : (draws, tests) what tests would have shown of their factors under the drawn effects.
    """
    conditioned = {level: effects[level].copy() for level in scatter.members}
    for node in np.unique(nodes):
        mask = nodes == node
        difference = scatter.log_factor - shown[mask]
        for level in scatter.members:
            conditioned[level][mask] += difference @ scatter.member_predictor(level, sd[mask][0]).T
    return conditioned


def log_factor_draws(draws: LawDraws, history: History, rng: np.random.Generator) -> dict[str, Floats]:
    """{level: (draws,) ln of its factor on the rate of one new test}."""
    scatter, factors = draws.fit.scatter_of_rates, {}
    for k, level in enumerate(scatter.levels):
        name = level_of(history, level)
        if level != "test" and name in scatter.members[level]:
            position = list(dict.fromkeys(scatter.members[level])).index(name)
            factors[level] = draws.members[level][:, position]
        else:
            factors[level] = draws.scatter_sd[:, k] * rng.standard_normal(draws.count)
    for level in unseen_levels(draws.fit, history):
        assumed = np.abs(USUAL_SD[level] * rng.standard_normal(draws.count))
        factors[level] = assumed * rng.standard_normal(draws.count)
    return factors


def factor_variances(draws: LawDraws, history: History) -> dict[str, float]:
    """{level: variance of ln of a new test's factor}: of a known heat or laboratory, what is not known of it."""
    scatter, variances = draws.fit.scatter_of_rates, {}
    for level in scatter.levels:
        name = level_of(history, level)
        if level != "test" and name in scatter.members[level]:
            position = list(dict.fromkeys(scatter.members[level])).index(name)
            variances[level] = float(draws.members[level][:, position].var())
        else:
            variances[level] = scatter.posterior.mean_square(level)
    return {**variances, **{level: USUAL_SD[level] ** 2 for level in unseen_levels(draws.fit, history)}}


def unseen_levels(fit: Identification, history: History) -> list[str]:
    """Levels of which a history states a member, while all fitted tests were of one other: their scatter is assumed."""
    scatter = fit.scatter_of_rates
    named = {level: level_of(history, level) for level in LEVELS[:-1]}
    return [
        level
        for level, name in named.items()
        if scatter.known is None and name and scatter.common.get(level, name) != name
    ]


@dataclass(frozen=True)
class Dimension:
    """A quantity of a test that is known to a tolerance: kind and unit are those of a Nuisance.

    shared : position among the unknowns of what all tests, or those of the alloy, share; None for its own.
    """

    kind: str
    mean: float
    sd: float
    low: float
    high: float
    shared: int | None = None


def dimensions_of(
    fit: Identification, history: History, predictor: Predictor, tolerances: Mapping[str, float]
) -> list[Dimension]:
    """What of a test is known to a tolerance: as given, as the fit estimated it, or as the specimen states it."""
    estimated = {(n.key, n.owner): k for k, n in enumerate(fit.nuisances)}
    own_predictor = predictor_for(predictor, history)
    dimensions: dict[str, Dimension] = {}
    for nuisance in fit.settings.nuisances:
        kind = nuisance.kind
        if kind not in TOLERANCE_KINDS or not supports_nuisance(own_predictor, kind):
            continue
        if not nuisance.applies_to(history.name):
            continue
        mean = prior_mean(nuisance, history, predictor)
        position = estimated.get((nuisance.key, owner_of(nuisance, history)))
        low, high = nuisance.bounds
        if nuisance.scope != "test" and position is not None:
            estimate = fit.nuisances[position]
            dimensions[kind] = Dimension(kind, estimate.value, estimate.sd, low, high, fit.u.size + position)
        else:
            spread = [n.prior_sd for n in fit.nuisances if n.key == nuisance.key] or [nuisance.sd or 0.0]
            finite = [sd for sd in spread if np.isfinite(sd)]
            dimensions[kind] = Dimension(kind, mean, finite[0] if finite else 0.0, low, high)
    for given, relative in (*_stated_tolerances(own_predictor), *((kind, None) for kind in tolerances)):
        if not supports_nuisance(own_predictor, given) or (relative is not None and given in dimensions):
            continue
        known = dimensions.get(given)
        mean = known.mean if known else prior_mean(Nuisance(given), history, predictor)  # type: ignore[arg-type]
        sd = tolerances[given] if relative is None else relative * mean
        dimensions[given] = Dimension(given, mean, sd, 0.0 if mean > 0 else -np.inf, np.inf)
    return list(dimensions.values())


def _stated_tolerances(predictor: Predictor) -> list[tuple[str, float]]:
    """(kind, relative standard deviation) of dimensions as a specimen states them."""
    return [*getattr(predictor, "tolerances", {}).items()]


def check_tolerances(tolerances: Mapping[str, float], histories: Sequence[History], predictor: Predictor) -> None:
    """FitError for a tolerance of what no test has, or that is no standard deviation."""
    for kind, sd in tolerances.items():
        if kind not in TOLERANCE_KINDS:
            raise FitError(f"a tolerance of '{kind}' is not known; {nearest(kind, TOLERANCE_KINDS)}")
        if not (np.isfinite(sd) and sd >= 0):
            raise FitError(f"the tolerance of '{kind}' is {sd}; give a standard deviation of zero or more, in its unit")
        if not any(supports_nuisance(predictor_for(predictor, h), kind) for h in histories):
            raise FitError(f"the tolerance of '{kind}' means nothing to the specimens of these tests; leave it out")


def dimension_draws(dimensions: Sequence[Dimension], draws: LawDraws, rng: np.random.Generator) -> dict[str, Floats]:
    """{kind: (draws, 1)} as predictors take them."""
    values = {}
    for one in dimensions:
        drawn = one.mean + one.sd * rng.standard_normal(draws.count)
        if one.shared is not None:
            drawn = draws.unknowns[:, one.shared]
        margin = 1e-3 * abs(one.mean)
        values[one.kind] = np.clip(drawn, one.low + margin, one.high - margin)[:, None]
    return values
