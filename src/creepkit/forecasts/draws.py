"""Draws from what an identification leaves uncertain of a new test: the law, the test's own rate, its dimensions.

The law's unknowns and the effects of heats and laboratories are drawn together, from their posterior distribution over
that of the scatter between tests (see inverse.uncertainty.rate_scatter).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import FitError, nearest
from creepkit.inverse.identification import Identification
from creepkit.inverse.nuisance_parameters import owner_of, prior_mean
from creepkit.inverse.uncertainty.importance_sampling import covariance_root
from creepkit.inverse.uncertainty.rate_scatter import USUAL_SD, NewTest
from creepkit.records import (
    COVARIANCE_NUISANCES,
    GENERAL_NUISANCES,
    STEP_NUISANCES,
    History,
    Nuisance,
    Predictor,
    all_dimensions,
    dimensions_of,
    is_length_nuisance,
)

TOLERANCE_KINDS = tuple(kind for kind in GENERAL_NUISANCES if kind not in (*COVARIANCE_NUISANCES, *STEP_NUISANCES))
"""Kinds of nuisance parameters that a tolerance can be given of, beside the lengths of test pieces."""


LARGEST_TOLERANCES = {"modulus": 0.3, "temperature": 100.0, "temperature drift": 100.0, "rate drift": 5.0}
"""Standard deviations, in the unit of the kind: relative, K, K, ln of a factor."""


LARGEST_OF_LENGTH = 0.25
"""Standard deviation of a length over the length itself."""


SOURCES = {
    "test": "scatter between tests",
    "heat": "scatter between heats",
    "laboratory": "scatter between laboratories",
}
"""What the scatter of each level is called among the parts of a band."""


MISFIT_THERE = "what the law misses at this stress and temperature"
"""Among the parts of a band."""


MOST_BATCHES = 50
"""Of draws, until enough of them lie within the bounds of the law; then some are taken more than once."""


BOUND_TOLERANCE = 1e-6
"""Of the width of the bounds: draws as near as this outside one count as inside."""


@dataclass(frozen=True, eq=False)
class LawDraws:
    """Draws of the unknowns of one identification and of the effects of its heats and laboratories.

    joint : (draws, unknowns + effects) x = (u, e), then ln factors (see RateScatter.groups). scatter_sd : (draws,
    levels) of ln rate, the scatter that each draw belongs to. outside : share of the draws of a Gaussian that lay
    outside the bounds of the law, for which others were drawn; 0 of samples.
    """

    fit: Identification
    joint: Floats
    scatter_sd: Floats
    outside: float = 0.0

    @property
    def count(self) -> int:
        """Number of draws."""
        return len(self.joint)

    @property
    def u(self) -> Floats:
        """(draws, parameters) conditioned coordinates of the law."""
        return self.joint[:, : self.fit.u.size]


def law_draws(fit: Identification, count: int, rng: np.random.Generator) -> LawDraws:
    """`count` draws of the unknowns of an identification and of the effects of its heats and laboratories.

    Where values lie at their bounds or are not determined, the unknowns of the law are its samples of the posterior,
    which the tests do not contradict. Of a Gaussian, draws outside the bounds of the law are drawn again: moved to a
    bound one by one, parameters that compensate each other would no longer do so.
    """
    if has_sampled_draws(fit):
        return _sampled_draws(fit, count, rng)
    drawn = [_joint_draws(fit, count, rng)]
    while sum(one.count for one in drawn) < count and len(drawn) < MOST_BATCHES:
        drawn.append(_joint_draws(fit, count, rng))
    none_within = not any(one.count for one in drawn)
    if none_within:
        drawn = [_joint_draws(fit, count, rng, within_bounds=False)]
    made = sum(one.count for one in drawn)
    outside = 1.0 if none_within else 1.0 - made / (count * len(drawn))
    chosen = np.arange(count) % made
    joint = np.concatenate([one.joint for one in drawn])[chosen]
    return LawDraws(fit, joint, np.concatenate([one.scatter_sd for one in drawn])[chosen], outside)


def has_sampled_draws(fit: Identification) -> bool:
    """Whether the unknowns of the law are drawn from samples of its posterior.

    Those do not know effects of heats, of laboratories and of what tests share, which are drawn together with the law.
    """
    shared = bool(fit.scatter_of_rates.groups) or any(n.scope != "test" for n in fit.nuisances)
    return fit.samples is not None and not shared


def _sampled_draws(fit: Identification, count: int, rng: np.random.Generator) -> LawDraws:
    """Draws with unknowns of the law from its samples; nuisances of single tests stay at their estimates."""
    assert fit.samples is not None
    posterior = fit.scatter_of_rates.posterior
    nodes = rng.permutation(systematic(posterior.weight, count, rng))
    samples = len(fit.samples)
    joint = np.tile(fit.x, (count, 1))
    joint[:, : fit.u.size] = fit.samples[rng.permutation(systematic(np.full(samples, 1.0 / samples), count, rng))]
    return LawDraws(fit, joint, posterior.sd[nodes])


def _joint_draws(fit: Identification, count: int, rng: np.random.Generator, *, within_bounds: bool = True) -> LawDraws:
    """Draws of all that is uncertain together, at most `count`: those within the bounds of the law."""
    scatter = fit.scatter_of_rates
    nodes = rng.permutation(systematic(scatter.posterior.weight, count, rng))
    sd = scatter.posterior.sd[nodes]
    normal = rng.standard_normal((count, scatter.joint_design.shape[1]))
    joint = np.empty_like(normal)
    for node in np.unique(nodes):
        mean, covariance = scatter.joint(scatter.posterior.sd[node])
        joint[nodes == node] = mean + normal[nodes == node] @ covariance_root(covariance).T
    joint[:, : fit.x.size] += fit.x
    kept = np.ones(count, bool)
    if within_bounds:
        theta = fit.coordinates.theta(joint[:, : fit.u.size])
        low, high = fit.law.internal_bounds
        margin = BOUND_TOLERANCE * (high - low)
        kept = ((theta >= low - margin) & (theta <= high + margin)).all(axis=1)
    return LawDraws(fit, joint[kept], sd[kept])


def systematic(weight: Floats, count: int, rng: np.random.Generator) -> Ints:
    """(count,) positions drawn with probabilities weight (positions,), as evenly as these allow."""
    points = (np.arange(count) + rng.random()) / count
    return np.minimum(np.searchsorted(np.cumsum(weight), points), weight.size - 1)


def log_factor_draws(draws: LawDraws, test: NewTest, rng: np.random.Generator) -> Floats:
    """(draws,) ln of the factor of one new test on the rate: effects that were fitted, and those drawn anew."""
    scatter = draws.fit.scatter_of_rates
    factor = draws.joint[:, [*test.known.values()]].sum(axis=1)
    for level in test.unknown:
        factor += draws.scatter_sd[:, scatter.levels.index(level)] * rng.standard_normal(draws.count)
    for level in test.unseen:
        factor += np.abs(USUAL_SD[level] * rng.standard_normal(draws.count)) * rng.standard_normal(draws.count)
    return np.asarray(factor + test.misfit * rng.standard_normal(draws.count))


def own_variances(fit: Identification, test: NewTest) -> dict[str, float]:
    """{source: variance of ln of what is new in the factor of a test on the rate}."""
    drawn = {SOURCES[level]: fit.scatter_of_rates.posterior.mean_square(level) for level in test.unknown}
    drawn.update({SOURCES[level]: USUAL_SD[level] ** 2 for level in test.unseen})
    return {**drawn, MISFIT_THERE: test.misfit**2} if test.misfit > 0 else drawn


@dataclass(frozen=True)
class UncertainQuantity:
    """A quantity of a test that is known to a tolerance: kind and unit are those of a Nuisance.

    shared : position among the unknowns of what all tests, or those of the alloy, share; None for its own.
    """

    kind: str
    mean: float
    sd: float
    low: float
    high: float
    shared: int | None = None


def uncertain_quantities(
    fit: Identification, history: History, predictor: Predictor, tolerances: Mapping[str, float]
) -> list[UncertainQuantity]:
    """What of a test is known to a tolerance: as given, as the fit estimated it, or as the specimen states it."""
    estimated = {(n.key, n.owner): k for k, n in enumerate(fit.nuisances)}
    own_predictor = predictor.for_history(history)
    dimensions: dict[str, UncertainQuantity] = {}
    for nuisance in fit.settings.nuisances:
        kind = nuisance.kind
        has_tolerance = kind in TOLERANCE_KINDS or is_length_nuisance(kind)
        if not (has_tolerance and own_predictor.follows(kind) and nuisance.applies_to(history.name)):
            continue
        mean = prior_mean(nuisance, history, predictor)
        position = estimated.get((nuisance.key, owner_of(nuisance, history)))
        low, high = nuisance.bounds
        if nuisance.scope != "test" and position is not None:
            estimate = fit.nuisances[position]
            dimensions[kind] = UncertainQuantity(kind, estimate.value, estimate.sd, low, high, fit.u.size + position)
        else:
            dimensions[kind] = UncertainQuantity(kind, mean, _spread_between_tests(fit, nuisance), low, high)
    stated = ((d.names[-1], d.tolerance) for d in dimensions_of(own_predictor) if d.tolerance > 0.0)  # relative ones
    for given, relative in (*stated, *((kind, None) for kind in tolerances)):
        if not own_predictor.follows(given) or (relative is not None and given in dimensions):
            continue
        known = dimensions.get(given)
        mean = known.mean if known else prior_mean(Nuisance(given), history, predictor)
        sd = tolerances[given] if relative is None else relative * mean
        dimensions[given] = UncertainQuantity(given, mean, sd, 0.0 if mean > 0 else -np.inf, np.inf)
    return list(dimensions.values())


def _spread_between_tests(fit: Identification, nuisance: Nuisance) -> float:
    """Standard deviation of a nuisance between tests: of its prior, or of its estimates where that is flat."""
    estimates = [n for n in fit.nuisances if n.key == nuisance.key]
    prior_sd = estimates[0].prior_sd if estimates else nuisance.sd or 0.0
    if np.isfinite(prior_sd):
        return float(prior_sd)
    return float(np.sqrt(np.mean([(n.value - n.prior_mean) ** 2 for n in estimates]))) if estimates else 0.0


def check_tolerances(tolerances: Mapping[str, float], histories: Sequence[History], predictor: Predictor) -> None:
    """FitError for a tolerance of what no test has, or that is no standard deviation."""
    for kind, sd in tolerances.items():
        lengths = {name for h in histories for d in dimensions_of(predictor.for_history(h)) for name in d.names}
        known = sorted({*TOLERANCE_KINDS, *lengths, *all_dimensions()})
        if kind not in known:
            raise FitError(f"a tolerance of '{kind}' is not known; {nearest(kind, known)}")
        if not (np.isfinite(sd) and sd >= 0):
            raise FitError(f"the tolerance of '{kind}' is {sd}; give a standard deviation of zero or more, in its unit")
        if sd > LARGEST_TOLERANCES.get(kind, np.inf):
            raise FitError(
                f"the tolerance of '{kind}' is {sd:g}; allowed are 0 to {LARGEST_TOLERANCES[kind]:g} "
                f"({'K' if 'temperature' in kind else 'relative, 0.05 for 5 %'})"
            )
        if not any(predictor.for_history(h).follows(kind) for h in histories):
            raise FitError(f"the tolerance of '{kind}' means nothing to the specimens of these tests; leave it out")
        for history in histories if is_length_nuisance(kind) else ():
            own = predictor.for_history(history)
            length = prior_mean(Nuisance(kind), history, own) if own.follows(kind) else np.inf
            if sd > LARGEST_OF_LENGTH * length:
                raise FitError(
                    f"the tolerance of '{kind}' is {sd:g} mm, of test '{history.name}' with {length:g} mm; at most "
                    f"{LARGEST_OF_LENGTH * length:g} mm is allowed"
                )


def dimension_draws(
    dimensions: Sequence[UncertainQuantity], draws: LawDraws, rng: np.random.Generator
) -> dict[str, Floats]:
    """{kind: (draws, 1)} as predictors take them."""
    values = {}
    for one in dimensions:
        drawn = one.mean + one.sd * rng.standard_normal(draws.count)
        if one.shared is not None:
            drawn = draws.joint[:, one.shared]
        margin = 1e-3 * abs(one.mean)
        values[one.kind] = np.clip(drawn, one.low + margin, one.high - margin)[:, None]
    return values
