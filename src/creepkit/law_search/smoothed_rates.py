"""Mean rates between points of smoothed creep curves, and laws fitted to them: what curves then judge.

A law's mean rate over an interval is an integral along the smoothed curve: nothing is differentiated, and nothing
solved. Tests differ by a factor of their own, and readings scatter; both variances are estimated with each law.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import sympy
from scipy.interpolate import PchipInterpolator
from scipy.optimize import nnls
from scipy.stats import qmc

from creepkit.arrays import Floats, Ints
from creepkit.errors import FitError
from creepkit.inverse.bounds import Bounds
from creepkit.inverse.reference_conditions import usable_frames
from creepkit.inverse.search.local_refinement import Minimum, Tolerances, bounded_least_squares
from creepkit.kernels import lower
from creepkit.language import CreepLaw
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.law_search.grammar import Product, Sentence, v
from creepkit.quality.smooth_curve import smooth_curve
from creepkit.records import History
from creepkit.records.loading import held_of

INTERVALS, FEWEST_POINTS = 16, 8
"""Of a curve that are compared, evenly apart in the logarithm of strain, and readings that a curve must have."""


DRAWS, STARTS = 128, 2
"""Sobol draws of a law's parameters that are compared, and those of them that are refined."""


STEPS = 12.0
"""Of a third of the trust region's first radius, across the bounds."""


SMOOTHING = 0.005
"""Relative error of a mean rate beside the readings' noise."""


SCALES = 0.05, 1.0
"""First standard deviation of ln rate between tests, and of the rest over what noise and smoothing say, its least."""


LEAST_BETWEEN = 0.01
"""Of ln rate between tests."""


UNDEFINED = 20.0
"""Residual of ln rate where a law has no rate."""


SHARE = 0.05
"""Of the rate at one point at least, with which a product begins."""


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)


@dataclass(frozen=True, eq=False)
class SmoothedRates:
    """Intervals of smoothed curves.

    stress : (intervals, 3) MPa. strain : (intervals, 3). time : (intervals, 3) s, at the points of Gauss in ln time.
    temperature : (intervals, 1) K. log_weight : (intervals, 3) ln of the points' weights in the mean rate. log_rate :
    (intervals,) ln of the mean rate in 1/s. error : (intervals,) its standard deviation but for a factor. test :
    (intervals,) number of the curve.
    """

    stress: Floats
    strain: Floats
    time: Floats
    temperature: Floats
    log_weight: Floats
    log_rate: Floats
    error: Floats
    test: Ints

    @classmethod
    def of_tests(cls, tests: Sequence[History]) -> SmoothedRates:
        """Those of the curves of bars; FitError where there are none."""
        found = [parts for test in tests if (parts := _intervals(test)) is not None]
        if not found:
            raise FitError(
                "search_laws() takes creep curves of bars, strain under a stress that is held, of "
                f"{FEWEST_POINTS} readings or more; found none"
            )
        number = np.repeat(np.arange(len(found)), [len(parts[-1]) for parts in found])
        stress, strain, time, temperature, log_weight, log_rate, error = map(np.concatenate, zip(*found, strict=True))
        return cls(stress, strain, time, temperature, log_weight, log_rate, error, number)

    def fitted(self, sentence: Sentence, near: RateFit | None = None) -> RateFit:
        """The least criterion of a sentence; kernels are those of its products, which others share.

        near : of a similar sentence, whose values some of the starts take.
        """
        laws = {product: _with_temperature(product, sentence) for product in sentence.products}
        parts = _Parts.of(laws, sentence.temperature == "arrhenius", sentence.T_ref)
        low, high = parts.bounds
        draws = parts.with_values(self._lives(parts, parts.draws(float(self.stress.min()))), near)
        draws = self._coefficients(parts, draws)
        scales, size = SCALES, self.log_rate.size

        def system(theta: Floats) -> tuple[Floats, Floats]:
            steps = np.where(theta < 0.5 * (low + high), 1e-6, -1e-6) * (high - low)
            logs = self._of_products(parts, theta)
            shares = np.exp(np.clip(logs - np.logaddexp.reduce(logs, axis=0), -UNDEFINED, 0.0))
            columns = np.zeros((low.size, size))
            for k, own in enumerate(parts.columns):
                changed = self._of_product(parts, k, (theta + np.diag(steps))[own])
                with np.errstate(invalid="ignore"):
                    slopes = (changed - logs[k]) / steps[own, None]
                columns[own] += shares[k] * np.where(np.isfinite(slopes), slopes, 0.0)
            return self._white(self._deviations(logs), scales), self._white(columns, scales).T

        def refined(theta: Floats, most: int) -> Minimum:
            box, scale = Bounds(low, high), (high - low) / STEPS
            no_limits = np.zeros(0), np.zeros((0, low.size))
            tolerances = Tolerances(most, 1e-4)
            return bounded_least_squares(system, theta, box, scale, tolerances, lambda _: no_limits, robust=True)

        costs = np.arcsinh(self._white(self._deviations(self._of_products(parts, draws)), scales) ** 2).sum(axis=1)
        end = min((refined(draws[k], 15) for k in np.argsort(costs)[:STARTS]), key=lambda one: one.cost)
        for _ in range(2):
            scales = self._scales(self._deviations(self._of_products(parts, end.x)))
            end = refined(end.x, 40)
        score = 2.0 * end.cost + self._log_determinant(scales) + low.size * np.log(size)
        log_rate = np.logaddexp.reduce(self._of_products(parts, end.x), axis=0)
        return RateFit(float(score), end.x[None], log_rate, parts.by_product(end.x))

    def _of_product(self, parts: _Parts, k: int, theta: Floats) -> Floats:
        """(..., intervals) ln of mean rates of a product; theta : (..., parameters) of the sentence."""
        point = (self.stress, self.strain, self.time, self.temperature, self.stress, self.stress / 3)
        values = np.moveaxis(theta[..., parts.columns[k]], -1, 0)[..., None, None]
        kernel = parts.kernels[k]
        named = dict(zip(kernel.law.names, values, strict=True))
        states = [self._state(symbol, named, parts.T_ref) for symbol in kernel.law.states]
        with np.errstate(all="ignore"):
            rates = kernel.internal_log_rate(*point, *states, *values)
            logs = self.log_weight + rates
            largest = logs.max(axis=-1)
            return np.asarray(largest + np.log(np.exp(logs - largest[..., None]).sum(axis=-1)))

    def _state(self, symbol: sympy.Symbol, values: Mapping[str, Floats], T_ref: float) -> Floats:
        """(..., intervals, 3) an internal variable along the smoothed curves, from what was measured.

        A back stress is driven by the strain and recovers, damage by time. values : {parameter: internal value}.
        """
        duration, rise = self._steps
        if symbol == v:
            gain = np.exp(self._log_life(values, T_ref)) * duration
            return np.minimum(self._followed(np.ones_like(gain), gain), 1.0 - 1e-8)
        decay = np.clip(np.exp(values["r"] + self._log_factor(values, "Q_r", T_ref)) * duration, 1e-12, 700.0)
        return self._followed(np.exp(-decay), np.exp(values["H"]) * rise * -np.expm1(-decay) / decay)

    def _log_life(self, values: Mapping[str, Floats], T_ref: float) -> Floats:
        """(..., intervals, 3) ln of the rate of damage, 1/s."""
        return np.asarray(values["D"] + values["chi"] * np.log(self.stress) + self._log_factor(values, "Q_D", T_ref))

    def _log_factor(self, values: Mapping[str, Floats], name: str, T_ref: float) -> Floats:
        """Arrhenius' factor of an activation energy, if the law has it."""
        energy = values.get(name, np.zeros(1))
        return np.asarray(-energy / GAS_CONSTANT * (1.0 / self.temperature - 1.0 / T_ref))

    def _followed(self, kept: Floats, gain: Floats) -> Floats:
        """(..., intervals, 3) a variable that from point to point of a curve keeps a share and gains, from zero."""
        shape = gain.shape
        kept, value = np.broadcast_to(kept, shape).reshape(*shape[:-2], -1), gain.reshape(*shape[:-2], -1).copy()
        first = len(_NODES) * self._starts
        counts = np.diff(first, append=value.shape[-1])
        for k in range(1, int(counts.max())):
            at = first[counts > k] + k
            value[..., at] += kept[..., at] * value[..., at - 1]
        return np.asarray(value.reshape(shape))

    @cached_property
    def _steps(self) -> tuple[Floats, Floats]:
        """(intervals, 3) time, s, and strain since the point before, and since the start of a curve at its first."""
        found = []
        for one in (self.time, self.strain):
            before = np.concatenate([[0.0], one.ravel()[:-1]])
            before[len(_NODES) * self._starts] = 0.0
            found.append(one - before.reshape(one.shape))
        return found[0], found[1]

    def _of_products(self, parts: _Parts, theta: Floats) -> Floats:
        """(products, ..., intervals) ln of mean rates."""
        return np.stack([self._of_product(parts, k, theta) for k in range(len(parts.columns))])

    def _deviations(self, logs: Floats) -> Floats:
        """(..., intervals) ln of the rate of a sum over the smoothed one."""
        with np.errstate(all="ignore"):
            values = np.logaddexp.reduce(logs, axis=0) - self.log_rate
        return np.where(np.isfinite(values), values, UNDEFINED)

    def _lives(self, parts: _Parts, draws: Floats) -> Floats:
        """Draws of damage whose life lasts as long as the tests, or up to twenty times."""
        for law, own in zip(parts.laws.values(), parts.columns, strict=True):
            if v in law.states:
                values = dict(zip(law.names, np.moveaxis(draws[:, own], -1, 0)[..., None, None], strict=True))
                column = own[law.names.index("D")]
                spent = (self._log_life(values | {"D": np.zeros(1)}, parts.T_ref) + np.log(self.time)).max(axis=(1, 2))
                low, high = parts.bounds[:, column]
                draws[:, column] = -spent - 3.0 * (draws[:, column] - low) / (high - low)
        return draws

    def _coefficients(self, parts: _Parts, draws: Floats) -> Floats:
        """Draws, the coefficients of whose products are those of least squares of the rate, none below a share."""
        shares = self._of_products(parts, draws) - self.log_rate
        shares = np.where(np.isfinite(shares), shares, -UNDEFINED)
        shift = np.median(shares, axis=-1)  # (products, draws)
        relative = np.exp(np.clip(shares - shift[..., None], -8.0, 8.0))
        for k in range(draws.shape[0]):
            several = relative.shape[0] > 1
            weights = nnls(relative[:, k].T, np.ones(self.log_rate.size))[0] if several else np.ones(1)
            least = SHARE / relative[:, k].max(axis=-1)
            draws[k, parts.rates] += np.log(np.maximum(weights, least)) - shift[:, k]
        return np.clip(draws, *parts.bounds)

    def _scales(self, deviations: Floats) -> tuple[float, float]:
        """Standard deviations between tests, and of the rest over what is expected; the least are stated."""
        count = int(self.test[-1]) + 1
        weights = self.error**-2.0
        total = np.bincount(self.test, weights, count)
        means = np.bincount(self.test, weights * deviations, count) / total
        rest = float(np.median(np.abs(deviations - means[self.test]) / self.error)) * 1.4826
        between = float(np.sqrt(np.mean(means**2)))
        return max(between, LEAST_BETWEEN), max(rest, SCALES[1])

    def _white(self, deviations: Floats, scales: tuple[float, float]) -> Floats:
        """(..., intervals) deviations over the square root of their covariance: a diagonal and one factor a test."""
        rest = scales[1]
        z = deviations / (rest * self.error)
        root, length = self._unit(scales)
        along = np.add.reduceat(root * z, self._starts, axis=-1)  # of each test
        return np.asarray(z + root * (along * (1.0 / np.sqrt(1.0 + length**2) - 1.0))[..., self.test])

    def _unit(self, scales: tuple[float, float]) -> tuple[Floats, Floats]:
        """The direction of a test's factor among its weighted residuals, and its length, (intervals,) and (tests,)."""
        along = scales[0] / (scales[1] * self.error)
        length = np.sqrt(np.add.reduceat(along**2, self._starts))
        return along / length[self.test], length

    def _log_determinant(self, scales: tuple[float, float]) -> float:
        length = self._unit(scales)[1]
        return float(2.0 * np.log(scales[1] * self.error).sum() + np.log1p(length**2).sum())

    @cached_property
    def _starts(self) -> Ints:
        return np.searchsorted(self.test, np.arange(int(self.test[-1]) + 1))


@dataclass(frozen=True, eq=False)
class _Parts:
    """Where the parameters of products stand in the vector of a sentence.

    columns : of each product. rates : columns of their coefficients. bounds : (2, parameters).
    """

    laws: dict[Product, CreepLaw]
    kernels: list[Any]
    T_ref: float
    columns: list[list[int]]
    rates: list[int]
    bounds: Floats

    @classmethod
    def of(cls, laws: dict[Product, CreepLaw], shared: bool, T_ref: float) -> _Parts:
        sizes = [len(law.params) - shared for law in laws.values()]
        ends = np.cumsum(sizes)
        last = [int(ends[-1])] if shared else []
        columns = [[*range(end - size, end), *last] for end, size in zip(ends, sizes, strict=True)]
        bounds = np.empty((2, int(ends[-1]) + shared))
        for law, own in zip(laws.values(), columns, strict=True):
            bounds[:, own] = law.internal_bounds
        kernels = [lower(law, "numpy") for law in laws.values()]
        rates = [own[0] for own in columns]  # the coefficient of a product is its first parameter
        return cls(laws, kernels, T_ref, columns, rates, bounds)

    def draws(self, least_stress: float) -> Floats:
        """(draws, parameters); a stress whose scale is linear is drawn below the least one of the tests, MPa."""
        low, high = self.bounds.copy()
        for law, own in zip(self.laws.values(), self.columns, strict=True):
            for param, column in zip(law.params.values(), own, strict=True):
                if param.unit == "MPa" and param.scale != "log":
                    high[column] = min(high[column], max(low[column], least_stress))
        return np.asarray(low + qmc.Sobol(low.size, seed=0).random(DRAWS) * (high - low))

    def with_values(self, draws: Floats, near: RateFit | None) -> Floats:
        """Draws, every other one of which has the values of a similar sentence, where that has them."""
        for product, own in zip(self.laws, self.columns, strict=True):
            values = {} if near is None else near.values_like(product)
            for name, column in zip(self.laws[product].names, own, strict=True):
                draws[::2, column] = values.get(name, draws[::2, column])
        return draws

    def by_product(self, theta: Floats) -> dict[Product, dict[str, float]]:
        """{product: {parameter: internal value}}."""
        named = zip(self.laws.items(), self.columns, strict=True)
        return {product: dict(zip(law.names, map(float, theta[own]), strict=True)) for (product, law), own in named}


@dataclass(frozen=True, eq=False)
class RateFit:
    """A sentence on smoothed rates.

    score : criterion. theta : (1, parameters) internal values of its law. log_rate : (intervals,) ln of its mean rate,
    1/s. values : {product: {parameter: internal value}}.
    """

    score: float
    theta: Floats
    log_rate: Floats
    values: dict[Product, dict[str, float]]

    def values_like(self, product: Product) -> dict[str, float]:
        """Values of that product here that shares most factors with one."""
        alike = lambda other: sum(getattr(other, f) == getattr(product, f) for f in other.__dataclass_fields__)  # noqa: E731
        return self.values[max(self.values, key=alike)]


def _with_temperature(product: Product, sentence: Sentence) -> CreepLaw:
    return replace(sentence, products=(product,)).law


def _intervals(test: History) -> tuple[Floats, ...] | None:
    """Those of one curve, as the fields of SmoothedRates; None of what is no creep curve of a bar."""
    if "strain" not in test.outputs or test.loading.quantity != "stress":
        return None
    used = usable_frames(test, "strain")
    times, strains = test.times[used], test.outputs["strain"][used]
    if times.size < FEWEST_POINTS:
        return None
    program = test.loading.program()
    curve = smooth_curve(times, strains, float(program.times[0]))
    values, _ = curve.fitted()
    usable = (values > 3.0 * curve.noise) & (curve.times > 0) & (values >= np.maximum.accumulate(values))
    if usable.sum() < FEWEST_POINTS:
        return None
    t, e = curve.times[usable], values[usable]
    even = np.searchsorted(np.log(e), np.linspace(np.log(e[0]), np.log(e[-1]), INTERVALS + 1)).clip(0, e.size - 1)
    even = np.unique(even)
    even = even[np.concatenate([[True], np.diff(e[even]) > 0])]
    x = np.log(t[even])
    points = 0.5 * (x[1:] + x[:-1])[:, None] + 0.5 * np.diff(x)[:, None] * _NODES
    strain = np.exp(PchipInterpolator(np.log(t), np.log(e))(points))
    stress = np.interp(np.exp(points), program.times, program.values)
    stress = stress * (np.exp(strain) if held_of(test.loading) == "load" else 1.0)
    duration, rise = np.diff(t[even]), np.diff(e[even])
    weights = np.log(0.5 * _WEIGHTS * np.diff(x)[:, None]) + points - np.log(duration)[:, None]
    temperature = np.full((rise.size, 1), test.mean_temperature)
    error = np.hypot(SMOOTHING, curve.noise / rise)
    return stress, strain, np.exp(points), temperature, weights, np.log(rise / duration), error
