"""Laplace's approximation: covariance and intervals of parameters, with their degrees of freedom.

The scatter between tests is in the covariance with its expected square, given the tests (see
inverse.perturbations); the noise of readings, of which there are many, with degrees of freedom of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

from creepkit.arrays import Floats
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel
from creepkit.inverse.uncertainty.mixture_distribution import NORMAL_FREEDOM
from creepkit.inverse.uncertainty.quantities import gradient
from creepkit.inverse.variance_components import LinearisedProblem
from creepkit.language import CreepLaw, Param

MINIMUM_FREEDOM = 3.0
"""Lower limit of degrees of freedom: below it a quantile only says that the variance is unknown."""


FREEDOMS = np.geomspace(MINIMUM_FREEDOM, NORMAL_FREEDOM, 400)
"""Degrees of freedom among which those of an interval are found."""


def known_to_freedom(covariance: Floats, within: Floats, freedom: float) -> Floats:
    """The covariance of the normal distribution whose 95 % intervals are those of Student's t, (n, n).

    covariance : (n, n). within : (n, n) the part of it by the noise of readings, which is estimated to `freedom`
    degrees of freedom: those readings that are independent, less the unknowns. The other part, by the scatter between
    tests, is a mean over what this may be.
    """
    scale = student.ppf(0.975, np.clip(freedom, MINIMUM_FREEDOM, NORMAL_FREEDOM)) / NORMAL_QUANTILE
    return np.asarray(covariance + (scale**2 - 1.0) * within)


def freedom_of_intervals(covariance: Floats, estimated: Floats) -> float:
    """Degrees of freedom of Student's t by which 95 % intervals of a covariance (n, n) are those of another one.

    estimated : (n, n) at the estimated noise, NORMAL_FREEDOM where it is as large; the median over the unknowns.
    """
    quantile = NORMAL_QUANTILE * float(np.median(np.sqrt(np.diag(covariance) / np.diag(estimated))))
    return float(np.interp(-quantile, -student.ppf(0.975, FREEDOMS), FREEDOMS))


DETERMINED_FACTOR, DETERMINED_SHARE = 10.0, 0.25
"""Widest 95 % interval of a parameter that is determined: a factor of ten of a coefficient, and a quarter of the bounds
of any parameter."""


OPEN_SHARE = 1.0 / 3.0
"""Share of the bounds from which on an interval is more that of the bounds than of the tests."""


NOT_DETERMINED, POORLY_DETERMINED = "not determined", "poorly determined"
"""Verdicts on a parameter whose interval is so wide: where it ends at a bound of the search, and where the tests bound
it on both sides."""


AT_BOUND = 1e-4
"""Distance from a bound over the width of the bounds within which a value lies at it."""


ONE_SIDED = "bounded on one side only"
"""Verdict on a parameter whose interval ends at a bound of the search."""


@dataclass(frozen=True)
class Estimate:
    """One parameter: value, 95 % interval in the author's unit, and a verdict.

    verdict : see verdict_of_interval.
    """

    name: str
    value: float
    low: float
    high: float
    unit: str
    verdict: str


NORMAL_QUANTILE = float(norm.ppf(0.975))
"""Half width of a 95 % interval in standard deviations."""


def covariance_root(covariance: Floats, scale: Floats | None = None) -> Floats:
    """A square root (n, n) of a covariance (n, n), without negative eigenvalues.

    Rounding makes some where the data hardly determine a combination of unknowns. scale : (n,) in units of which they
    are taken, by default its standard deviations.
    """
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300)) if scale is None else scale
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T) / np.outer(scale, scale))
    return np.asarray(scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))


def positive_semidefinite(covariance: Floats, scale: Floats | None = None) -> Floats:
    """The nearest covariance (n, n) without negative eigenvalues; scale : (n,) as of covariance_root()."""
    root = covariance_root(covariance, scale)
    return np.asarray(root @ root.T)


def covariance_of_values(
    linearised: LinearisedProblem, noise_model: NoiseModel, working_noise: NoiseModel | None = None
) -> Floats:
    """(unknowns, unknowns) posterior covariance of x = (u, e), all of them free, where the problem was made linear.

    Of values by likelihood (J'C^-1 J + P)^-1, with C the covariance of the residuals and P the precision of the priors.
    working_noise : under whose covariance, 1 / W, values were found that are not by likelihood, with the covariance
    M (J'W C W J + P) M, M = (J'W J + P)^-1.
    """
    residuals, free = linearised.residuals, linearised.whole
    if working_noise is None:
        return free.solve(CovarianceFactor.of_residuals(residuals, noise_model)).covariance
    plain = replace(residuals, random_effect_sensitivities=None, common_effects=None)
    solution = free.solve(CovarianceFactor.of_residuals(plain, working_noise))
    weighted, roots = solution.weighted_jacobian, CovarianceFactor.of_residuals(residuals, noise_model).roots
    pulls = [np.einsum("tfp,tfg->ptg", weighted, roots).reshape(weighted.shape[-1], -1)]
    if residuals.common_effects is not None:
        pulls.append(np.einsum("tfp,tfk->pk", weighted, residuals.common_effects))
    # squared last: of pulls by common effects that nearly cancel in the values the squares would be rounding
    moved = solution.covariance @ np.concatenate([*pulls, np.diag(np.sqrt(linearised.precision))], axis=1)
    return np.asarray(moved @ moved.T)


def parameter_estimates(law: CreepLaw, coordinates: Coordinates, u: Floats, covariance: Floats) -> tuple[Estimate, ...]:
    """95 % intervals of the author's parameters.

    u : (parameters,) conditioned coordinates; covariance : (parameters, parameters) theirs.
    """
    theta = coordinates.theta(u)
    to_theta = coordinates.jacobian(u)
    sd = np.sqrt(np.diag(to_theta @ covariance @ to_theta.T))
    results = []
    for (name, param), value, standard_deviation in zip(law.table.items(), theta, sd, strict=True):
        low, high = (param.to_internal(b) for b in param.bounds)
        value = min(max(value, low), high)
        value = low if value - low < 1e-9 * (high - low) else high if high - value < 1e-9 * (high - low) else value
        a, b = (min(max(value + side * NORMAL_QUANTILE * standard_deviation, low), high) for side in (-1.0, 1.0))
        middle, bottom, top = (param.from_internal(float(v)) for v in (value, a, b))
        verdict = verdict_of_interval(param, float(value), (float(a), float(b)))
        results.append(Estimate(name, middle, bottom, top, param.unit, verdict))
    return tuple(results)


def cut_intervals(law: CreepLaw, estimates: Sequence[Estimate]) -> dict[str, float]:
    """{parameter that the tests bound on one side only: bound at which its interval ends}."""
    found = {}
    for one in estimates:
        bounds = law.table[one.name].bounds
        cut = [b for b, is_cut in zip(bounds, ends_at_bounds(law, one), strict=True) if is_cut]
        if one.verdict in ("determined", ONE_SIDED) and cut:
            found[one.name] = cut[0]
    return found


def ends_at_bounds(law: CreepLaw, estimate: Estimate) -> tuple[bool, bool]:
    """Whether the lower and the upper end of an interval are bounds of the search, and not found by the tests."""
    ends = zip(law.table[estimate.name].bounds, (estimate.low, estimate.high), strict=True)
    low, high = (bool(np.isclose(b, end, rtol=1e-9, atol=0.0)) for b, end in ends)  # rates are far below 1e-8
    return low, high


def bound_marks(law: CreepLaw, estimate: Estimate) -> tuple[str, str]:
    """What stands behind the ends of an interval in every table and text: which of them are bounds of the search."""
    low, high = (" (search bound)" if at_bound else "" for at_bound in ends_at_bounds(law, estimate))
    return low, high


def interval_ends(
    law: CreepLaw, estimate: Estimate, written: Callable[[float], str] = "{:.4g}".format
) -> tuple[str, str]:
    """The ends of a 95 % interval in plain text, with those marked that are bounds of the search."""
    marks = bound_marks(law, estimate)
    return f"{written(estimate.low)}{marks[0]}", f"{written(estimate.high)}{marks[1]}"


def verdict_of_interval(param: Param, value: float, interval: tuple[float, float]) -> str:
    """What the tests say of a parameter, given its law: the one rule of tables, texts and exports.

    A 95 % interval wider than a quarter of the bounds, or than a factor of ten where the scale is log, does not
    determine it: "not determined" where it ends at a bound, "poorly determined" where the tests bound it on both sides.
    Else "at its bound" where the value lies there; "bounded on one side only" where the interval ends at a bound of the
    search; "determined". value, interval : on the internal scale, the interval cut at the bounds.
    """
    (low, high), (lowest, highest) = interval, (param.to_internal(bound) for bound in param.bounds)
    width = highest - lowest
    widest = DETERMINED_SHARE * width
    if param.scale == "log":
        widest = min(widest, float(np.log(DETERMINED_FACTOR)))
    cut = min(low - lowest, highest - high) <= 1e-9 * width
    if high - low > widest:
        return NOT_DETERMINED if cut else POORLY_DETERMINED
    if _lies_at_bound(param, value):
        return "at its bound"
    return ONE_SIDED if cut else "determined"


def lies_at_bound(param: Param, estimate: Estimate) -> bool:
    """Whether the value of an estimate lies at a bound of the search."""
    return _lies_at_bound(param, param.to_internal(estimate.value))


def is_open(param: Param, estimate: Estimate) -> bool:
    """Whether bounds of the search say more of a parameter than the tests: its interval fills a third, or it is at one.

    Gaussian draws about such a value are not those of the tests.
    """
    low, high, *bounds = (param.to_internal(x) for x in (estimate.low, estimate.high, *param.bounds))
    return high - low >= OPEN_SHARE * (bounds[1] - bounds[0]) or lies_at_bound(param, estimate)


def _lies_at_bound(param: Param, value: float) -> bool:
    low, high = (param.to_internal(bound) for bound in param.bounds)
    return min(value - low, high - value) <= AT_BOUND * (high - low)


def delta_method(
    function: Callable[[Floats], Floats], point: Floats, covariance: Floats, step: float = 1e-4
) -> tuple[Floats, Floats]:
    """Value and standard deviation of functions of u, by the delta method with central differences.

    function : u (parameters,) -> (...,). point : (parameters,) u. covariance : (parameters, parameters) of u.
    Returns (...,) values and (...,) standard deviations.
    """
    derivatives = gradient(function, point, np.sqrt(np.diag(covariance)), step)
    return function(point), np.sqrt(np.einsum("...i,ij,...j->...", derivatives, covariance, derivatives))
