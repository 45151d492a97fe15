"""A creep curve under one load as a smoothing spline with level shifts and changes of slope.

The spline is of fifth order (thrice integrated white noise) in t, t^1/2 or ln t, whichever is likeliest; noise and
stiffness are found by REML. A law that hardens, softens or drifts smoothly is followed by the spline, but for the sharp
bend of primary creep just after a load. What happens between two frames is not, and is a fixed effect of the
regression: a step of the value, or of the slope.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri, stdtr

from creepkit.arrays import Bools, Floats
from creepkit.quality.frames import block_means

MOST_POINTS = 150
"""Points of a curve; longer ones are averaged over neighbouring frames."""


FEWEST_POINTS_BESIDE = 5
"""Points that a curve must have on either side of a change, so that its slopes there are known."""


FEWEST_POINTS_AFTER_LOAD = 12
"""Points from a load to a change of slope: before, the bend of primary creep may look like one."""


_STIFFNESS = np.concatenate([[0.0], 10.0 ** np.arange(-3.0, 12.1, 0.5)])
"""Variance of the spline's third derivative over that of the noise, for a curve of length 1."""


_NOISE_FLOOR = 5e-4
"""Least noise, as a fraction of the range of the values: no spline follows a law more closely."""


_CLOCKS: dict[str, Callable[[Floats], Floats]] = {"t": np.positive, "sqrt t": np.sqrt, "ln t": np.log}


class RateStep(NamedTuple):
    """A step of the slope at one time.

    before, after : slope, unit of the output a second. log_factor : ln(after / before). log_factor_sd : its standard
    deviation. jump, jump_sd : step of the value at the same time, fitted beside it, and its standard deviation.
    """

    before: float
    after: float
    log_factor: float
    log_factor_sd: float
    jump: float
    jump_sd: float


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
    level_shifts: tuple[float, ...]
    slope_changes: tuple[float, ...]
    _basis: Floats
    _variances: Floats
    _stiffness: float

    def position(self, times: Floats) -> Floats:
        """(...,) times (s) on the clock of the spline, from 0 to 1 over the curve."""
        first, last = (float(_CLOCKS[self.clock](self.times[k] - self.start)) for k in (0, -1))
        return np.asarray((_CLOCKS[self.clock](times - self.start) - first) / (last - first))

    def covers(self, times: Floats) -> Bools:
        """(...,) bool, whether enough points lie on either side of a time (s) for a change of slope to be seen."""
        count = np.searchsorted(self.times, times, side="right")
        return np.asarray((count >= FEWEST_POINTS_AFTER_LOAD) & (self.times.size - count >= FEWEST_POINTS_BESIDE))

    def slope_change_scores(self, times: Floats) -> tuple[Floats, Floats]:
        """Scores of a step of the slope at each time (s), and the precision of ln of the factor on the rate.

        Both (times,), NaN and 0 at times that the curve does not cover. A score is the estimate over its standard
        deviation, as a standard normal number.
        """
        covered = self.covers(times)
        scores, precisions = np.full(times.size, np.nan), np.zeros(times.size)
        if covered.any():
            estimate, sd, freedom = self._effects(self._ramps(times[covered]))
            rate = np.interp(self.position(times[covered]), self.position(self.times), self._slope(self._fitted()))
            scores[covered] = _normal_score(estimate / sd, freedom)
            precisions[covered] = np.maximum(rate, 1e-3 * np.abs(rate).max() + 1e-300) / sd
        return scores, precisions

    def level_shift_scores(self) -> tuple[Floats, Floats, Floats]:
        """Times (s), scores and sizes of a step of the value in every gap between points, beside a step of the slope.

        Each (gaps,); scores as in slope_change_scores, over their own spread where that is above 1.
        """
        k = np.arange(FEWEST_POINTS_BESIDE, self.times.size - FEWEST_POINTS_BESIDE + 1)
        times = 0.5 * (self.times[k - 1] + self.times[k])
        if not times.size:
            return times, times, times
        estimate, sd, freedom = self._effects(self._steps(times), beside=self._ramps(times))
        scores = _normal_score(estimate / sd, freedom)
        return times, scores / max(1.0, robust_spread(scores)), estimate

    def autocorrelation_inflation(self) -> float:
        """Factor on standard deviations for noise that is correlated from point to point, at least 1.

        ((1 + r) / (1 - r))^1/2 with r the first autocorrelation of what the curve leaves, as of an AR(1) process.
        """
        left = self.values - self._fitted()
        variance = float((left**2).sum())
        r = float((left[1:] * left[:-1]).sum()) / variance if variance > 0 else 0.0
        return float(np.sqrt((1 + r) / (1 - r))) if 0 < r < 1 else 1.0

    def fitted(self) -> tuple[Floats, Floats]:
        """(points,) values of the curve less its noise, and their rates, unit of the output a second."""
        values, seconds = self._fitted(), 1e-6 * (self.times - self.start)
        ends = self.position(self.times + seconds), self.position(self.times - seconds)
        return values, self._slope(values) * (ends[0] - ends[1]) / (2.0 * seconds)

    def rate_step(self, time: float) -> RateStep:
        """The step of the slope at a time (s), with a step of the value fitted beside it."""
        one = np.array([time])
        position = self.position(one)
        ramp, step = self._ramps(one), self._steps(one)
        (change,), (change_sd,), _ = self._effects(ramp)
        (jump,), (jump_sd,), _ = self._effects(step, beside=ramp)
        smooth = self._fitted(ramp * change) - (ramp * change)[:, 0]
        before = float(np.interp(position[0], self.position(self.times), self._slope(smooth)))
        mean, least = before + 0.5 * change, 0.05 * abs(before + 0.5 * change)
        first, second = max(before, least), max(before + change, least)
        seconds = 1e-6 * (self.times[-1] - self.times[0])
        per_second = float(self.position(one + seconds)[0] - position[0]) / seconds
        log_sd = float(change_sd) * abs(mean) / (first * second)
        # The change may lie anywhere between two frames, which moves the value by the difference of the slopes.
        gap = float(np.diff(self.times).max(where=_beside(self.times, time), initial=0.0)) * per_second
        jump_sd = float(np.hypot(jump_sd, change * gap / 12**0.5))
        values = (first * per_second, second * per_second, np.log(second / first), log_sd, jump, jump_sd)
        return RateStep(*(float(value) for value in values))

    def _ramps(self, times: Floats) -> Floats:
        return np.asarray(np.maximum(self.position(self.times)[:, None] - self.position(times)[None, :], 0.0))

    def _steps(self, times: Floats) -> Floats:
        return np.asarray((self.times[:, None] > times[None, :]).astype(float))

    def _effects(self, regressors: Floats, beside: Floats | None = None) -> tuple[Floats, Floats, int]:
        """Estimate and standard deviation of each regressor alone, or beside another one each, and the freedom."""
        u, columns = self._basis.T @ self.values, self._basis.T @ regressors
        others = np.zeros_like(columns) if beside is None else self._basis.T @ beside
        degrees = u.size - (1 if beside is None else 2)
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

    def _fitted(self, effects: Floats | None = None) -> Floats:
        """(points,) values of the curve less its noise; effects : (points, 1) what further regressors explain."""
        u = self._basis.T @ (self.values if effects is None else self.values - effects[:, 0])
        return np.asarray(self.values - self._basis @ (u / (1.0 + self._stiffness * self._variances)))

    def _slope(self, values: Floats) -> Floats:
        """(points,) slope of a smooth curve; over a gap with a known step of the value, that of the gaps beside it."""
        s = self.position(self.times)
        slopes = np.diff(values) / np.diff(s)
        for shift in self.level_shifts:
            gap = int(np.clip(np.searchsorted(self.times, shift) - 1, 1, slopes.size - 2))
            slopes[gap] = 0.5 * (slopes[gap - 1] + slopes[gap + 1])
        return np.asarray(np.interp(s, 0.5 * (s[1:] + s[:-1]), slopes))


def smooth_curve(
    times: Floats,
    values: Floats,
    start: float,
    *,
    level_shifts: Sequence[float] = (),
    slope_changes: Sequence[float] = (),
) -> SmoothCurve:
    """Fit a curve, with steps of the value and of the slope at known times (s).

    times : (frames,) s, after `start`. values : (frames,) in the unit of the output.
    """
    times, values = block_means(MOST_POINTS, times, values)
    curves = [_fit(times, values, start, clock, tuple(level_shifts), tuple(slope_changes)) for clock in _CLOCKS]
    return max(curves, key=lambda pair: pair[0])[1]


def robust_spread(scores: Floats) -> float:
    """Standard deviation of scores about zero by the median of their sizes; 0 of none.

    scores : (times,), those that are NaN left out.
    """
    known = np.abs(scores[np.isfinite(scores)])
    return float(1.4826 * np.median(known)) if known.size else 0.0


def _fit(
    times: Floats, values: Floats, start: float, clock: str, shifts: tuple[float, ...], changes: tuple[float, ...]
) -> tuple[float, SmoothCurve]:
    nothing = np.zeros(0)
    empty = SmoothCurve(times, values, start, clock, 0.0, shifts, changes, nothing, nothing, 0.0)
    s = empty.position(times)
    known = [np.vander(s, 3), empty._steps(np.array(shifts)), empty._ramps(np.array(changes))]
    design = np.column_stack([part for part in known if part.size])
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
    curve = SmoothCurve(
        times, values, start, clock, float(noise[k] ** 0.5), shifts, changes, basis, variances, float(_STIFFNESS[k])
    )
    return float(likelihood[k]), curve


def _beside(times: Floats, time: float) -> Bools:
    """(points - 1,) which gaps between points touch a time."""
    return np.asarray((times[:-1] <= time) & (times[1:] >= time))


def _normal_score(ratio: Floats, freedom: int) -> Floats:
    """A ratio with Student's distribution as the standard normal number of the same probability."""
    return np.asarray(-np.sign(ratio) * ndtri(np.maximum(stdtr(freedom, -np.abs(ratio)), 1e-300)))
