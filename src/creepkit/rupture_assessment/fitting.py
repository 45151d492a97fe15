"""Maximum likelihood of one method, and its observed information.

The likelihood is marginal, with right-censored run-outs and random effects of heats and laboratories.

log10 of the time of a test is m + b + s e, with m by the method, b the sum of the effects of its heat and laboratory,
each normal with mean 0, and e standard normal. A test that broke contributes its density, a run-out the probability
that it lasts longer (Tobin (1958), Econometrica 26, 24).

Effects are integrated out. With one kind of effect by adaptive Gauss-Hermite quadrature about the mode of each effect
(Liu, Pierce (1994), Biometrika 81, 624), with two by Laplace's approximation about their joint mode. Both are exact, to
rounding, without run-outs: there the integrand is Gaussian.

All functions take several candidates at once, so that derivatives by differences cost one call.

Few tests may by chance lie so near to a curve of many constants that their scatter seems to be none. So a scatter that
is usual counts as that of USUAL_TESTS tests more: a scaled inverse chi-square distribution of the variance.

Monkman-Grant's relation is two such fits: rupture times by minimum creep rates, and these by a rate law.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.sparse import csr_array
from scipy.special import logsumexp, stdtrit

from creepkit.arrays import Bools, Floats, frozen
from creepkit.errors import FitError
from creepkit.inverse.noise_covariance import HALF_LOG_TAU, log_survival
from creepkit.inverse.uncertainty.quantities import gradient
from creepkit.records import SECONDS_PER_HOUR
from creepkit.rupture_assessment.methods import MINIMUM_RATE, MONKMAN_GRANT, Basis, Centre, Conditions, RuptureMethod
from creepkit.rupture_assessment.observed_tests import RuptureTests, TensileStrength
from creepkit.rupture_assessment.rupture_fit import (
    LEAST_SCALE,
    RuptureFit,
    RuptureParameter,
    StudentLogTime,
    VarianceFreedom,
    variance_freedom,
)

NODES = 15
"""Of Gauss-Hermite quadrature."""

MODE_STEPS = 30
"""To the mode of the effects: far more than a concave function needs."""

LARGEST_STEP = 4.0
"""Of an effect in one Newton step, in scales: e^z is steep."""

USUAL_TESTS = 2.0
"""As which the usual scatter counts: for 7 tests of 3 temperatures, whose lives scatter by 0.1 to 0.2, intervals of a
strength at 1e5 h hold it in 93 % of plans with it, and in 87 % without; for 10 tests in 94 % with and without."""

LEAST_SCATTER = 1e-9
"""Standard deviation of an effect that is none, log10 of time."""


@dataclass(frozen=True, eq=False)
class GroupedTimes:
    """Observed log times and which effects they share.

    log_time, censored : (tests,). members : one matrix (tests, levels) of zeros and ones for each kind of effect.
    """

    log_time: Floats
    censored: Bools
    members: tuple[Floats, ...]

    @classmethod
    def of(cls, log_time: Floats, censored: Bools, groups: Mapping[str, Sequence[str]]) -> GroupedTimes:
        """With the groups by name, in their order."""
        members = []
        for values in groups.values():
            levels = sorted(set(values))
            members.append(np.array([[float(v == level) for level in levels] for v in values]))
        return cls(log_time, censored, tuple(members))

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
        lasting, hazard = log_survival(z)
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
        one, other = np.nonzero(members.T @ members)  # pairs of levels that share tests, which are few of all pairs
        shared = csr_array(members[:, one] * members[:, other])
        for _ in range(MODE_STEPS):
            _, first, second = self._terms(mean + effects @ members.T, scale[:, None])
            hessian = precision[:, :, None] * np.eye(scatter.shape[1])
            hessian[:, one, other] -= second @ shared
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
        for _ in range(MODE_STEPS):  # levels share no test, so each has a Newton iteration of its own
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


GRADIENT_STEP, HESSIAN_STEP = 1e-5, 3e-4
"""Of central differences, in coordinates of order one."""

CURVATURES = np.linspace(-0.98, 0.98, 41)
"""Of Manson-Haferd's k tried as starts, between the values at which isotherms of the tests would meet."""

MOST_NUMBERS = 200_000
"""Candidates times tests whose likelihood is found at once: some 100 MB."""

NEWTON_STEPS = 6
"""After the quasi-Newton method: to the last digits."""

LEAST_INDEPENDENCE = 1e-9
"""Smallest singular value of the scaled functions of a method at which its coefficients are determined."""


Cost = Callable[[Floats], Floats]
"""Negative log-likelihoods (candidates,) of estimates (candidates, estimates)."""


@dataclass(frozen=True, eq=False)
class _Scaled:
    """The problem in coordinates of order one: mean = offset + U c + k V c, with U orthogonal.

    usual : standard deviation of log10 of time that counts as that of so many tests added.
    """

    times: GroupedTimes
    offset: Floats
    linear: Floats
    bilinear: Floats | None
    transform: Floats  # coefficients = transform @ scaled coefficients
    usual: float
    added: float

    @property
    def location_count(self) -> int:
        return int(self.linear.shape[1]) + (self.bilinear is not None)

    def unit(self, scale: float) -> Floats:
        """(estimates,) steps of one likelihood: of coefficients, Manson-Haferd's k, ln of the scale, and scatters."""
        unit = np.full(self.location_count + 1 + len(self.times.members), scale)
        unit[self.location_count] = 1.0
        if self.bilinear is not None:
            unit[self.location_count - 1] = 1.0 / max(float(np.abs(self.bilinear).max()), 1e-12)
        return unit

    def about(self, start: Floats, unit: Floats) -> Cost:
        """The cost about a point, in units of each coordinate."""
        return lambda candidates: self.cost(start + unit * candidates)

    def mean(self, candidates: Floats) -> Floats:
        count = self.linear.shape[1]
        mean = self.offset + candidates[:, :count] @ self.linear.T
        if self.bilinear is not None:
            mean = mean + candidates[:, count, None] * (candidates[:, :count] @ self.bilinear.T)
        return np.asarray(mean)

    def cost(self, candidates: Floats) -> Floats:
        """(candidates,) negative log-likelihoods; the scale enters as its logarithm."""
        location = self.location_count
        scale = np.exp(np.clip(candidates[:, location], -30.0, 10.0))
        scatter, mean = candidates[:, location + 1 :], self.mean(candidates)
        rows = max(MOST_NUMBERS // mean.shape[1], 1)
        parts = [slice(k, k + rows) for k in range(0, len(candidates), rows)]
        value = -np.concatenate([self.times.log_likelihood(mean[p], scale[p], scatter[p]) for p in parts])
        value += self.added * (np.log(scale) + 0.5 * (self.usual / scale) ** 2)
        return np.where(np.isfinite(value), value, 1e30)


def _gradient(cost: Cost, point: Floats) -> Floats:
    steps = GRADIENT_STEP * np.eye(point.size)
    values = cost(np.concatenate([point + steps, point - steps]))
    return np.asarray((values[: point.size] - values[point.size :]) / (2.0 * GRADIENT_STEP))


def _hessian(cost: Cost, point: Floats) -> Floats:
    size, steps = point.size, HESSIAN_STEP * np.eye(point.size)
    first, second = np.tril_indices(size)
    signs = ((1, 1), (1, -1), (-1, 1), (-1, -1))
    values = cost(np.concatenate([point + a * steps[first] + b * steps[second] for a, b in signs]))
    plus_plus, plus_minus, minus_plus, minus_minus = values.reshape(4, -1)
    matrix = np.zeros((size, size))
    matrix[first, second] = (plus_plus - plus_minus - minus_plus + minus_minus) / (4.0 * HESSIAN_STEP**2)
    return np.asarray(matrix + np.tril(matrix, -1).T)


def conditions_of(tests: RuptureTests, tensile: TensileStrength | None = None) -> Conditions:
    """The conditions of tests; tensile : of temperatures, where a test does not state its own."""
    strength = tests.tensile_strength
    if tensile is not None:
        strength = np.where(np.isfinite(strength), strength, tensile(np.asarray(tests.temperature)))
    return Conditions(tests.stress, tests.temperature, strength, tests.minimum_rate)


def centre_of(tests: RuptureTests) -> Centre:
    """Means of the tests."""
    return Centre(float(tests.temperature.mean()), float(np.log10(tests.stress).mean()))


def fit_method(
    method: RuptureMethod,
    tests: RuptureTests,
    at: Conditions,
    *,
    degree: int,
    fixed: Mapping[str, float],
    level: float,
    usual: float = 0.0,
) -> RuptureFit:
    """The maximum of the likelihood; FitError where the tests do not determine the coefficients.

    usual : scatter of log10 of the time of a test that counts beside that of the tests; 0 for none.
    """
    centre = centre_of(tests)
    basis = method.basis(at, degree, fixed, centre)
    times = GroupedTimes.of(tests.log_time, tests.censored, tests.groups)
    problem = _scaled(method, basis, times, tests.ruptured, usual)
    point = _minimum(problem, _start(problem, tests))
    location, count = problem.location_count, problem.linear.shape[1]
    scale, scatter = float(np.exp(point[location])), np.abs(point[location + 1 :])
    broke = tests.ruptured + problem.added
    freedom = float(max(broke - location, 1))
    levels = [m.shape[1] for m in times.members]
    scale_corrected = scale * float(np.sqrt(broke / freedom))
    scatter_corrected = scatter * np.sqrt([h / (h - 1.0) for h in levels])
    corrected = np.array([*point[:location], np.log(scale_corrected), *scatter_corrected])
    covariance = _covariance(problem, point, corrected)
    # From scaled coordinates to those of the basis; the scale stands as its logarithm.
    jacobian = np.eye(point.size)
    jacobian[:count, :count] = problem.transform
    jacobian[location, location] = scale
    covariance = jacobian @ covariance @ jacobian.T
    estimates = np.array([*problem.transform @ point[:count], *point[count:location]])
    variances = _variance_freedom(problem, point, scale_corrected, scatter_corrected)
    variances = variances.transformed(jacobian[:location, :location])
    effects = times.effects(problem.mean(point[None])[0], scale, scatter)

    def constants(p: Floats) -> dict[str, float]:
        return method.parameters(p[:count], float(p[count]) if method.bilinear else 0.0, degree, fixed, centre)

    def by_group(values: Sequence[Any]) -> dict[str, Any]:
        return dict(zip(tests.groups, values, strict=True))

    return RuptureFit(
        method.name,
        degree,
        dict(fixed),
        centre,
        estimates[:count],
        float(point[count]) if method.bilinear else 0.0,
        scale,
        by_group([*map(float, scatter)]),
        by_group(levels),
        covariance,
        scale_corrected,
        by_group([*map(float, scatter_corrected)]),
        -float(problem.cost(point[None])[0]),
        variances,
        tests.ruptured,
        tuple(
            RuptureParameter(name, value, value - half, value + half, method.unit(name))
            for name, (value, half) in _with_half_widths(constants, estimates, covariance, variances, level).items()
        ),
        by_group(
            [
                dict(zip(sorted(set(values)), map(float, modes), strict=True))
                for values, modes in zip(tests.groups.values(), effects, strict=True)
            ]
        ),
        level,
    )


def too_few_tests(
    method: RuptureMethod, tests: RuptureTests, at: Conditions, *, degree: int, fixed: Mapping[str, float]
) -> str:
    """Why a method is not offered for so few tests, "" where it is.

    With n tests that broke, k constants and g scatters between groups n - k - g - 1 must be above zero, so that the
    scatter of a test has two degrees of freedom or more: a curve with one passes through nearly all tests by chance;
    and a criterion takes that for a good fit. Two are enough for bounds of Student's distribution to hold, and asking
    for more would leave out curvature that few tests have (measured: rupture_strength_coverage).
    """
    constants = method.basis(at, degree, fixed, centre_of(tests)).linear.shape[1] + method.bilinear
    needed = constants + len(tests.groups) + 2
    if tests.ruptured >= needed:
        return ""
    broke = "1 test broke" if tests.ruptured == 1 else f"{tests.ruptured} tests broke"
    scatters = "a scatter" if not tests.groups else f"{1 + len(tests.groups)} scatters"
    return f"{broke}, and {constants} constants with {scatters} take {needed} or more; add tests"


def _scaled(method: RuptureMethod, basis: Basis, times: GroupedTimes, ruptured: int, usual: float) -> _Scaled:
    size = np.linalg.norm(basis.linear, axis=0)
    count = basis.linear.shape[1] + method.bilinear
    broken = (basis.linear / np.maximum(size, 1e-300))[~times.censored]
    if ruptured < count + 1 or np.linalg.svd(broken, compute_uv=False)[-1] < LEAST_INDEPENDENCE:
        raise FitError(
            f"{ruptured} tests that broke do not determine the {count} constants of {method.name}; add tests at other "
            "stresses or temperatures"
        )
    _, R = np.linalg.qr(basis.linear)
    transform = np.linalg.inv(R) * np.sqrt(times.log_time.size)
    bilinear = None if basis.bilinear is None else basis.bilinear @ transform
    return _Scaled(times, basis.offset, basis.linear @ transform, bilinear, transform, usual, USUAL_TESTS * (usual > 0))


def _start(problem: _Scaled, tests: RuptureTests) -> Floats:
    """Least squares, run-outs taken as broken; Manson-Haferd's k from a line of values."""
    target = problem.times.log_time - problem.offset
    best: tuple[float, Any, float] | None = None
    warmer = tests.temperature - tests.temperature.mean()
    for share in CURVATURES if problem.bilinear is not None else (0.0,):
        reach = -warmer.min() if share > 0 else warmer.max()
        k = float(share / max(reach, 1e-9))
        columns = problem.linear if problem.bilinear is None else problem.linear + k * problem.bilinear
        coefficients, *_ = np.linalg.lstsq(columns, target, rcond=None)
        squares = float(((target - columns @ coefficients) ** 2).sum())
        if best is None or squares < best[0]:
            best = squares, coefficients, k
    assert best is not None
    scale = max(np.sqrt(best[0] / target.size), LEAST_SCALE)
    location = [*best[1], *([] if problem.bilinear is None else [best[2]])]
    return np.array([*location, np.log(scale), *[0.5 * scale for _ in problem.times.members]])


def _minimum(problem: _Scaled, start: Floats) -> Floats:
    """By a quasi-Newton method, then Newton steps until they end; FitError where the scatter vanishes."""
    unit, location = problem.unit(float(np.exp(start[problem.location_count]))), problem.location_count
    cost = problem.about(start, unit)

    def value(point: Floats) -> float:
        return float(cost(point[None])[0])

    options = {"gtol": 1e-5, "maxiter": 300}
    point = minimize(value, np.zeros(start.size), jac=partial(_gradient, cost), method="BFGS", options=options).x
    for _ in range(NEWTON_STEPS):
        gradient, (values, vectors) = _gradient(cost, point), np.linalg.eigh(_hessian(cost, point))
        step = -vectors @ ((vectors.T @ gradient) / np.maximum(np.abs(values), 1e-6 * np.abs(values).max()))
        if not value(point + step) <= value(point) + 1e-9:
            break
        point = point + step
        if np.abs(step).max() < 1e-11:
            break
    point = start + unit * point
    if np.exp(point[location]) < LEAST_SCALE:
        raise FitError("the method passes through every rupture time, so there is no scatter to estimate; add tests")
    return np.asarray(point)


def _variance_freedom(problem: _Scaled, point: Floats, scale: float, scatter: Floats) -> VarianceFreedom:
    """Of the tests that broke, about the estimates."""
    broken, count = ~problem.times.censored, problem.linear.shape[1]
    columns = problem.linear
    if problem.bilinear is not None:
        columns = np.column_stack([columns + point[count] * problem.bilinear, problem.bilinear @ point[:count]])
    members = [m[broken] for m in problem.times.members]
    return variance_freedom(columns[broken], members, scale**2, [float(v) for v in scatter**2], problem.added)


def _covariance(problem: _Scaled, point: Floats, corrected: Floats) -> Floats:
    """Inverse of the observed information; of location parameters with scale and scatters corrected for freedom."""
    location, unit = problem.location_count, problem.unit(float(np.exp(point[problem.location_count])))
    full, at_corrected = (_hessian(problem.about(base, unit), np.zeros(point.size)) for base in (point, corrected))
    covariance = _inverse(full)
    more = _inverse(at_corrected[:location, :location]) - _inverse(full[:location, :location])
    covariance[:location, :location] += more
    return covariance * np.outer(unit, unit)


def _inverse(matrix: Floats) -> Floats:
    """Of a symmetric matrix; directions that are flat, or fall, get a large variance."""
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    return np.asarray((vectors / np.maximum(values, 1e-8 * max(values.max(), 1e-300))) @ vectors.T)


def _with_half_widths(
    constants: Callable[[Floats], dict[str, float]],
    point: Floats,
    covariance: Floats,
    freedom: VarianceFreedom,
    level: float,
) -> dict[str, tuple[float, float]]:
    """{constant as the literature writes it: (value, half the width of its interval)}, by the delta method.

    point : (estimates,) of location. covariance : of all, those first.
    """
    part = covariance[: point.size, : point.size]
    spread = np.sqrt(np.maximum(np.diag(part), 0.0))
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        at = constants(point)
        jacobian = gradient(lambda p: np.array([*constants(p).values()]), point, spread, 1e-3)
        variance = np.einsum("mi,ij,mj->m", jacobian, part, jacobian)
        half = stdtrit(freedom.of(jacobian), 0.5 + 0.5 * level) * np.sqrt(np.maximum(variance, 0.0))
    return {name: (value, float(h)) for (name, value), h in zip(at.items(), half, strict=True)}


UNUSED_ENERGY = 300e3
"""J/mol, of a rate law of tests at one temperature; it is used at that temperature alone."""


@dataclass(frozen=True, eq=False)
class MinimumRateRelation:
    """Rupture times by minimum rates.

    times : log10 t = c - m log10 of the rate, of the tests with both. rates : the rate law, of all tests with a rate.
    Its predictions by stress and temperature take the scatters of rates and of times for independent.
    """

    times: RuptureFit
    rates: RuptureFit

    def log_time(self, at: Conditions, of: str) -> StudentLogTime:
        """Distribution of log10 of a time in hours; by the rate where it is known, else by the rate law."""
        if np.isfinite(at.rate).all():
            return self.times.log_time(at, of)
        log_rate = self.rates.log_time(at, of)
        predicted = replace(at, rate=10.0**log_rate.median / SECONDS_PER_HOUR)
        by_rate = self.times.log_time(predicted, of)
        m = self.times["m"].value
        spread = np.hypot(by_rate.spread, m * log_rate.spread)
        return StudentLogTime(by_rate.median, spread, np.minimum(by_rate.freedom, log_rate.freedom))

    def test_scatter(self, at: Conditions) -> StudentLogTime:
        """Distribution of log10 of the time of one test over the median time of its heat, by its rate."""
        return self.times.test_scatter(at)


def fit_relation(
    tests: RuptureTests, with_rate: RuptureTests, *, level: float, usual: float = 0.0
) -> MinimumRateRelation:
    """The relation and its rate law; FitError, in one sentence, where rates are missing or too few."""
    known = np.isfinite(tests.minimum_rate)
    if not known.any():
        raise FitError("no test has a minimum creep rate, which monkman-grant needs; add minimum_rate to the tests")
    both = tests[known]
    times = fit_method(MONKMAN_GRANT, both, conditions_of(both), degree=1, fixed={}, level=level, usual=usual)
    log_rates = replace(
        with_rate,
        log_time=frozen(np.log10(with_rate.minimum_rate * SECONDS_PER_HOUR)),
        censored=frozen(np.zeros(len(with_rate)), dtype=bool),
    )
    fixed = {"Q": UNUSED_ENERGY} if with_rate.isothermal else {}
    at = conditions_of(with_rate)
    rates = fit_method(MINIMUM_RATE, log_rates, at, degree=1, fixed=fixed, level=level, usual=usual)
    return MinimumRateRelation(times, rates)


LEAST_CURVATURE = 0.01
"""Probability below which rates say that one stress exponent does not hold for all of them."""


def curvature_probability(with_rate: RuptureTests) -> float:
    """Probability of so much curvature of ln rate over ln stress if there were none, by the F test; 1 of few rates."""
    from scipy.stats import f as f_distribution

    x, y = np.log(with_rate.stress), np.log(with_rate.minimum_rate)
    line = [np.ones_like(x), x - x.mean(), *([] if with_rate.isothermal else [1.0 / with_rate.temperature])]
    left = []
    for columns in (line, [*line, (x - x.mean()) ** 2]):
        A = np.stack([column / np.abs(column).max() for column in columns], axis=1)
        if np.linalg.matrix_rank(A) < A.shape[1] or len(y) < A.shape[1] + 2:
            return 1.0
        left.append(float(np.sum((y - A @ np.linalg.lstsq(A, y, rcond=None)[0]) ** 2)))
    freedom = len(y) - len(line) - 1
    return float(f_distribution.sf((left[0] - left[1]) * freedom / max(left[1], 1e-300), 1, freedom))
