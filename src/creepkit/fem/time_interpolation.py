"""Interpolation in time between the accepted steps of a simulation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from creepkit.arrays import Bools, Floats, Ints
from creepkit.fem.solver import PRESSURE, START
from creepkit.integration.time_discretisation import SMALLEST_EXPONENT

OFFSET = 20.0
"""s; twice the first step after a change of load."""


SHORT = 0.2
"""A last step this much shorter than the one before does not count for the spline."""


@dataclass(frozen=True, eq=False)
class TimeInterpolation:
    """The accepted steps of a simulation.

    times : (steps,) s. starts : (segments reached,) s. rows : first and last step of each segment; without a jump of
    the load the first is the last one of the segment before. origins : (segments reached,) s, zero of the time y.
    exponents : (segments reached,) beta.
    """

    times: Floats
    starts: Floats
    rows: tuple[tuple[int, int], ...]
    origins: Floats
    exponents: Floats

    @classmethod
    def from_steps(cls, times: Floats, segments: Ints, program: Floats, beta: float = 1.0) -> TimeInterpolation:
        """From the rows of a record and the program (segments, 10); beta : the law's leading exponent of time."""
        rows = []
        reached = program[: int(segments[-1]) + 1]
        starts = reached[:, START].copy()
        for n, start in enumerate(starts):
            mine = np.flatnonzero(segments == n)
            at_start = np.flatnonzero((segments == n) & (times == start))
            first = int(at_start[-1]) if at_start.size else int(mine[0]) - 1
            rows.append((first, int(mine[-1])))
        # a pressure that rises from nothing gives no power of time; long after zero only the change of load matters
        young = np.where(starts == 0.0, reached[:, PRESSURE] != 0.0, starts <= OFFSET) & (beta < 1.0)
        exponents = np.where(young, max(beta, SMALLEST_EXPONENT), 1.0)
        return cls(np.array(times), starts, tuple(rows), np.where(young, 0.0, starts), exponents)

    def interpolate(self, values: Floats, times: Floats) -> Floats:
        """Values (steps, ...) at other times, (times, ...); NaN after the last step.

        At the time of a jump it is the value before it; at time zero the one after.
        """
        times = np.atleast_1d(np.asarray(times, float))
        out = np.full((times.size, *values.shape[1:]), np.nan)
        which = np.maximum(np.searchsorted(self.starts, times, side="left") - 1, 0)
        for n, (first, last) in enumerate(self.rows):
            mine = (which == n) & (times <= self.times[-1] * (1 + 1e-12))
            if mine.any():
                before, after = self._variable(n, self.times[first : last + 1]), self._variable(n, times[mine])
                kept = _spline_knots(before)
                out[mine] = _spline(before[kept], values[first : last + 1][kept], after)
        return out

    def moved(self, times: Floats, starts: Floats) -> TimeInterpolation:
        """The same steps at other times, the segments beginning at others too."""
        origins = np.where(self.origins == self.starts, self.origins + starts, self.origins)
        return replace(self, times=self.times + times, starts=self.starts + starts, origins=origins)

    def _variable(self, n: int, times: Floats) -> Floats:
        """What the values of segment `n` are smooth in."""
        first, last = self.rows[n]
        elapsed = np.maximum(times - self.origins[n], 0.0)
        if last - first == 1:  # a single step: the few seconds of a ramp, elastic and so straight
            return np.asarray(elapsed)
        return np.asarray(np.log1p((elapsed / OFFSET) ** self.exponents[n]))


def _spline_knots(places: Floats) -> Bools:
    """All knots, less the last but one where a short last step, cut off by the end, would make a slope of its error."""
    kept = np.ones(places.size, bool)
    if places.size > 3:
        before, final = np.diff(places[-3:])
        kept[-2] = final > SHORT * before
    return kept


def _spline(before: Floats, values: Floats, after: Floats) -> Floats:
    """Values at places `after` from those at `before`."""
    if before.size == 1:
        return np.repeat(values, after.size, axis=0)
    return np.asarray(CubicSpline(before, values)(after))
