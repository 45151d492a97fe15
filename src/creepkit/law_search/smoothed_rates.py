"""Rates of smoothed creep curves, and laws fitted to them: cheap proposals, which the curves themselves judge later."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.frame_noise import usable_frames
from creepkit.kernels import lower
from creepkit.language import CreepLaw
from creepkit.law_search.grammar import Product, Sentence
from creepkit.quality.smooth_curve import smooth_curve
from creepkit.records import History
from creepkit.records.loading import held_of

POINTS, FEWEST_POINTS = 16, 8
"""Of a curve that are compared, evenly apart in the logarithm of strain, and readings that a curve must have."""


DRAWS, STARTS = 64, 2
"""Sobol draws of a law's parameters that are compared, and those of them that are refined."""


ROUGHNESS = 0.05
"""Of ln rate, below which a smoothed rate is not known; larger residuals count less (soft L1)."""


UNDEFINED = 20.0
"""Residual of ln rate where a law has no rate."""


@dataclass(frozen=True, eq=False)
class SmoothedRates:
    """Points of smoothed curves.

    stress : (points,) MPa. strain : (points,). time : (points,) s. temperature : (points,) K. log_rate : (points,)
    ln of the rate in 1/s.
    """

    stress: Floats
    strain: Floats
    time: Floats
    temperature: Floats
    log_rate: Floats

    @classmethod
    def of_tests(cls, tests: Sequence[History]) -> SmoothedRates:
        """Those of the curves of bars; FitError where there are none."""
        found = [points for test in tests if (points := _points(test)) is not None]
        if not found:
            raise FitError(
                "search_laws() takes creep curves of bars, strain under a stress that is held, of "
                f"{FEWEST_POINTS} readings or more; found none"
            )
        return cls(*np.concatenate(found, axis=1))

    def fitted(self, sentence: Sentence) -> RateFit:
        """The least criterion of a sentence on these rates; kernels are those of its products, which others share."""
        laws = [_with_temperature(product, sentence) for product in sentence.products]
        kernels, shared = [lower(law, "numpy") for law in laws], sentence.temperature == "arrhenius"
        point = (self.stress, self.strain, self.time, self.temperature, self.stress, self.stress / 3)
        sizes = [len(law.params) - shared for law in laws]
        ends = np.cumsum(sizes)
        bounds = [law.internal_bounds[:, :size] for law, size in zip(laws, sizes, strict=True)]
        low, high = np.concatenate([*bounds, *([laws[0].internal_bounds[:, -1:]] if shared else [])], axis=1)

        def residuals(theta: Floats) -> Floats:
            parts = [theta[..., end - size : end] for end, size in zip(ends, sizes, strict=True)]
            if shared:
                parts = [np.concatenate([part, theta[..., -1:]], axis=-1) for part in parts]
            with np.errstate(all="ignore"):
                rates = [
                    kernel.internal_log_rate(*point, *np.moveaxis(part, -1, 0)[..., None])
                    for kernel, part in zip(kernels, parts, strict=True)
                ]
                values = np.logaddexp.reduce(rates) - self.log_rate
            return np.asarray(np.where(np.isfinite(values), values, UNDEFINED) / ROUGHNESS)

        def jacobian(theta: Floats) -> Floats:
            steps = 1e-6 * (high - low)
            return np.asarray((residuals(theta + np.diag(steps)) - residuals(theta)[None]) / steps[:, None]).T

        draws = low + qmc.Sobol(low.size, seed=0).random(DRAWS) * (high - low)
        rates = list(ends - sizes)  # the coefficient of a product is its first parameter
        for _ in range(2):
            draws[:, rates] -= np.median(residuals(draws), axis=1)[:, None] * ROUGHNESS
            draws = np.clip(draws, low, high)
        order = np.argsort(np.arcsinh(residuals(draws) ** 2).sum(axis=1))[:STARTS]
        found = [
            least_squares(residuals, draws[k], jacobian, (low, high), loss="soft_l1", x_scale="jac", max_nfev=60)
            for k in order
        ]
        found.sort(key=lambda end: end.cost)
        count = self.log_rate.size
        score = count * np.log(2.0 * found[0].cost / count + 1.0) + low.size * np.log(count)
        log_rate = residuals(found[0].x) * ROUGHNESS + self.log_rate
        return RateFit(float(score), np.stack([end.x for end in found]), log_rate)


@dataclass(frozen=True, eq=False)
class RateFit:
    """A sentence on smoothed rates.

    score : criterion. theta : (starts, parameters) internal values of its law, best first. log_rate : (points,) ln of
    its rate, 1/s.
    """

    score: float
    theta: Floats
    log_rate: Floats


def _with_temperature(product: Product, sentence: Sentence) -> CreepLaw:
    return replace(sentence, products=(product,)).law


def _points(test: History) -> Floats | None:
    """(5, points) of one curve; None of what is no creep curve of a bar."""
    if "strain" not in test.outputs or test.loading.quantity != "stress":
        return None
    used = usable_frames(test, "strain")
    times, strains = test.times[used], test.outputs["strain"][used]
    if times.size < FEWEST_POINTS:
        return None
    program = test.loading.program()
    curve = smooth_curve(times, strains, float(program.times[0]))
    values, rates = curve.fitted()
    usable = (values > 3.0 * curve.noise) & (rates > 0) & (curve.times > 0)
    if usable.sum() < FEWEST_POINTS:
        return None
    t, e, r = curve.times[usable], values[usable], rates[usable]
    even = np.unique(np.searchsorted(np.log(e), np.linspace(np.log(e[0]), np.log(e[-1]), POINTS)).clip(0, e.size - 1))
    stress = np.interp(t, program.times, program.values) * (np.exp(e) if held_of(test.loading) == "load" else 1.0)
    return np.stack([stress, e, t, np.full(e.size, test.mean_temperature), np.log(r)])[:, even]
