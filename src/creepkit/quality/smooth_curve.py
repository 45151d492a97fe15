"""A creep curve under one load as a smoothing spline with level shifts.

The spline is of fifth order (thrice integrated white noise) in t, t^1/2 or ln t, whichever is likeliest; noise and
stiffness are found by REML. A law that hardens, softens or drifts smoothly is followed by the spline, but for the sharp
bend of primary creep just after a load. A step of the value between two frames is not, and is a fixed effect of the
regression.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtr

from creepkit.arrays import Floats
from creepkit.quality.frames import block_means

MOST_POINTS = 150
"""Points of a curve; longer ones are averaged over neighbouring frames."""


FEWEST_POINTS_BESIDE = 5
"""Points that a curve must have on either side of a change, so that its slopes there are known."""


_STIFFNESS = np.concatenate([[0.0], 10.0 ** np.arange(-3.0, 12.1, 0.5)])
"""Variance of the spline's third derivative over that of the noise, for a curve of length 1."""


_NOISE_FLOOR = 5e-4
"""Least noise, as a fraction of the range of the values: no spline follows a law more closely."""


_CLOCKS: dict[str, Callable[[Floats], Floats]] = {"t": np.positive, "sqrt t": np.sqrt, "ln t": np.log}


@dataclass(frozen=True, eq=False)
class SmoothCurve:
    """A fitted curve; times are counted from the start of its load.

    times, values : (points,) s and unit of the output. start : s, when its load was there. clock : the time scale in
    which the spline is smooth. noise : standard deviation of the points.
    """

    times: Floats
    values: Floats
    start: float
    clock: str
    noise: float
    _basis: Floats
    _variances: Floats
    _stiffness: float

    def position(self, times: Floats) -> Floats:
        """(...,) times (s) on the clock of the spline, from 0 to 1 over the curve."""
        first, last = (float(_CLOCKS[self.clock](self.times[k] - self.start)) for k in (0, -1))
        return np.asarray((_CLOCKS[self.clock](times - self.start) - first) / (last - first))

    def level_shift_scores(self) -> tuple[Floats, Floats, Floats]:
        """Times (s), scores and sizes of a step of the value in every gap between points, beside a step of the slope.

        Each (gaps,). A score is the estimate over its standard deviation, as a standard normal number, and over the
        spread of all of them where that is above 1.
        """
        k = np.arange(FEWEST_POINTS_BESIDE, self.times.size - FEWEST_POINTS_BESIDE + 1)
        times = 0.5 * (self.times[k - 1] + self.times[k])
        if not times.size:
            return times, times, times
        estimate, sd, freedom = self._effects(self._steps(times), self._ramps(times))
        scores = _normal_score(estimate / sd, freedom)
        return times, scores / max(1.0, robust_spread(scores)), estimate

    def fitted(self) -> tuple[Floats, Floats]:
        """(points,) values of the curve less its noise, and their rates, unit of the output a second."""
        values, seconds = self._fitted(), 1e-6 * (self.times - self.start)
        ends = self.position(self.times + seconds), self.position(self.times - seconds)
        return values, self._slope(values) * (ends[0] - ends[1]) / (2.0 * seconds)

    def _ramps(self, times: Floats) -> Floats:
        return np.asarray(np.maximum(self.position(self.times)[:, None] - self.position(times)[None, :], 0.0))

    def _steps(self, times: Floats) -> Floats:
        return np.asarray((self.times[:, None] > times[None, :]).astype(float))

    def _effects(self, regressors: Floats, beside: Floats) -> tuple[Floats, Floats, int]:
        """Estimate and standard deviation of each regressor beside another one each, and the freedom."""
        u, columns, others = (self._basis.T @ part for part in (self.values, regressors, beside))
        degrees = u.size - 2
        floor = u.size * (_NOISE_FLOOR * float(np.ptp(self.values)) + 1e-300) ** 2
        weights = 1.0 / (1.0 + np.outer(_STIFFNESS, self._variances))
        pairs = [(columns, columns), (columns, u[:, None]), (columns, others), (others, others), (others, u[:, None])]
        cc, cu, co, oo, ou = (weights @ (a * b) for a, b in pairs)  # (stiffnesses, regressors)
        inverse = np.divide(1.0, oo, out=np.zeros_like(oo), where=oo > 0)
        information = np.maximum(cc - co**2 * inverse, 1e-12 * np.maximum(cc, 1e-300))
        value = (cu - co * ou * inverse) / information
        remainder = (weights @ u**2)[:, None] - ou**2 * inverse - value**2 * information
        variance = np.maximum(remainder, floor) / degrees
        likelihood = np.log(weights).sum(axis=1)[:, None] - degrees * np.log(variance) - np.log(information)
        likelihood -= np.log(oo, out=np.zeros_like(oo), where=oo > 0)
        best = likelihood.argmax(axis=0)[None]
        estimate, square = (np.take_along_axis(a, best, axis=0)[0] for a in (value, variance / information))
        return estimate, np.sqrt(square), degrees

    def _fitted(self) -> Floats:
        """(points,) values of the curve less its noise."""
        u = self._basis.T @ self.values
        return np.asarray(self.values - self._basis @ (u / (1.0 + self._stiffness * self._variances)))

    def _slope(self, values: Floats) -> Floats:
        """(points,) slope of a smooth curve."""
        s = self.position(self.times)
        return np.asarray(np.interp(s, 0.5 * (s[1:] + s[:-1]), np.diff(values) / np.diff(s)))


def smooth_curve(times: Floats, values: Floats, start: float, level_shifts: Sequence[float] = ()) -> SmoothCurve:
    """Fit a curve, with steps of the value at known times (s).

    times : (frames,) s, after `start`. values : (frames,) in the unit of the output.
    """
    times, values = block_means(MOST_POINTS, times, values)
    curves = [_fit(times, values, start, clock, level_shifts) for clock in _CLOCKS]
    return max(curves, key=lambda pair: pair[0])[1]


def robust_spread(scores: Floats) -> float:
    """Standard deviation of scores about zero by the median of their sizes; 0 of none.

    scores : (times,), those that are NaN left out.
    """
    known = np.abs(scores[np.isfinite(scores)])
    return float(1.4826 * np.median(known)) if known.size else 0.0


def _fit(times: Floats, values: Floats, start: float, clock: str, shifts: Sequence[float]) -> tuple[float, SmoothCurve]:
    empty = SmoothCurve(times, values, start, clock, 0.0, np.zeros(0), np.zeros(0), 0.0)
    s = empty.position(times)
    design = np.column_stack([np.vander(s, 3), empty._steps(np.array(shifts))])
    complement = np.linalg.qr(design, mode="complete")[0][:, design.shape[1] :]
    low, gap = np.minimum.outer(s, s), np.abs(np.subtract.outer(s, s))
    covariance = low**3 * (low**2 / 20 + gap * low / 8 + gap**2 / 12)
    variances, vectors = np.linalg.eigh(complement.T @ covariance @ complement)
    basis, variances = complement @ vectors, np.maximum(variances, 0.0)
    u = basis.T @ values
    weights = 1.0 / (1.0 + np.outer(_STIFFNESS, variances))
    floor = (_NOISE_FLOOR * float(np.ptp(values)) + 1e-300) ** 2
    noise = np.maximum((weights * u**2).mean(axis=1), floor)
    likelihood = -0.5 * (u.size * np.log(noise) - np.log(weights).sum(axis=1))
    k = int(np.argmax(likelihood))
    sigma, stiffness = float(noise[k] ** 0.5), float(_STIFFNESS[k])
    return float(likelihood[k]), SmoothCurve(times, values, start, clock, sigma, basis, variances, stiffness)


def _normal_score(ratio: Floats, freedom: int) -> Floats:
    """A ratio with Student's distribution as the standard normal number of the same probability."""
    return np.asarray(-np.sign(ratio) * ndtri(np.maximum(stdtr(freedom, -np.abs(ratio)), 1e-300)))
