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
        """Times (s), scores and sizes of a step of the value in every gap between points, the rate as it was.

        Each (gaps,). A score is the estimate over its standard deviation, as a standard normal number.
        """
        k = np.arange(FEWEST_POINTS_BESIDE, self.times.size - FEWEST_POINTS_BESIDE + 1)
        times = 0.5 * (self.times[k - 1] + self.times[k])
        if not times.size:
            return times, times, times
        u, columns = self._basis.T @ self.values, self._basis.T @ self._steps(times)
        degrees = u.size - 1
        floor = u.size * (_NOISE_FLOOR * float(np.ptp(self.values)) + 1e-300) ** 2
        weights = 1.0 / (1.0 + np.outer(_STIFFNESS, self._variances))
        information, product = weights @ columns**2, weights @ (columns * u[:, None])  # (stiffnesses, gaps)
        sizes = product / information
        variance = np.maximum((weights @ u**2)[:, None] - sizes * product, floor) / degrees
        likelihood = np.log(weights).sum(axis=1)[:, None] - degrees * np.log(variance) - np.log(information)
        best = likelihood.argmax(axis=0)[None]
        size, square = (np.take_along_axis(one, best, axis=0)[0] for one in (sizes, variance / information))
        ratio = size / np.sqrt(square)
        return times, -np.sign(ratio) * ndtri(np.maximum(stdtr(degrees, -np.abs(ratio)), 1e-300)), size

    def fitted(self) -> tuple[Floats, Floats]:
        """(points,) values of the curve less its noise, and their rates, unit of the output a second."""
        values, seconds = self._fitted(), 1e-6 * (self.times - self.start)
        ends = self.position(self.times + seconds), self.position(self.times - seconds)
        return values, self._slope(values) * (ends[0] - ends[1]) / (2.0 * seconds)

    def _steps(self, times: Floats) -> Floats:
        return np.asarray((self.times[:, None] > times[None, :]).astype(float))

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
