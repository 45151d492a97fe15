"""Rates of smoothed creep curves, and laws fitted to them: cheap proposals, which the curves themselves judge later."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.frame_noise import usable_frames
from creepkit.kernels import lower
from creepkit.language import CreepLaw
from creepkit.quality.smooth_curve import smooth_curve
from creepkit.records import History
from creepkit.records.loading import held_of

POINTS, FEWEST_POINTS = 16, 8
"""Of a curve that are compared, evenly apart in the logarithm of strain, and readings that a curve must have."""


DRAWS, STARTS = 64, 2
"""Sobol draws of a law's parameters that are compared, and those of them that are refined."""


ROUGHNESS = 0.05
"""Of ln rate, below which a smoothed rate is not known; larger residuals count less (soft L1)."""


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

    def fitted(self, law: CreepLaw) -> tuple[float, Floats]:
        """The least criterion of a law on these rates, and its log rates there, (points,): infinite where none is."""
        kernel, (low, high) = lower(law, "numpy"), law.internal_bounds
        point = (self.stress, self.strain, self.time, self.temperature, self.stress, self.stress / 3)

        def residuals(theta: Floats) -> Floats:
            with np.errstate(all="ignore"):
                values = kernel.internal_log_rate(*point, *theta.T[..., None]) - self.log_rate
            return np.asarray(np.where(np.isfinite(values), values, 20.0) / ROUGHNESS)

        def jacobian(theta: Floats) -> Floats:
            steps = 1e-6 * (high - low)
            return np.asarray((residuals(theta + np.diag(steps)) - residuals(theta)[None]) / steps[:, None]).T

        draws = low + qmc.Sobol(low.size, seed=0).random(DRAWS) * (high - low)
        rates = [k for k, p in enumerate(law.params.values()) if p.scale == "log" and p.unit == "1/s"]
        for _ in range(2):
            draws[:, rates] -= np.median(residuals(draws), axis=1)[:, None] * ROUGHNESS
            draws = np.clip(draws, low, high)
        order = np.argsort(np.arcsinh(residuals(draws) ** 2).sum(axis=1))[:STARTS]
        ends = [
            least_squares(residuals, draws[k], jacobian, (low, high), loss="soft_l1", x_scale="jac", max_nfev=60)
            for k in order
        ]
        best, count = min(ends, key=lambda end: end.cost), self.log_rate.size
        score = count * np.log(2.0 * best.cost / count + 1.0) + low.size * np.log(count)
        return float(score), residuals(best.x) * ROUGHNESS + self.log_rate


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
