"""Timeline: values between the accepted steps of a march, by splines in a variable in which they are smooth.

Each segment of the load program has its own spline, in ln(t - t0 + 20 s): creep after a change of load decays over
decades of time. Splines of sparse steps fail before the steps do, so the steps of a march may at most double the time
elapsed since the segment began.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from creepkit.arrays import Floats, Ints

OFFSET = 20.0
"""s; twice the first step after a change of load."""


@dataclass(frozen=True, eq=False)
class Timeline:
    """The accepted steps of a march.

    times : (steps,) s. starts : (segments reached,) s. rows : first and last step of each segment; without a jump of
    the load the first is the last one of the segment before.
    """

    times: Floats
    starts: Floats
    rows: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, times: Floats, segments: Ints, starts: Floats) -> Timeline:
        """From the rows of a record and the starts of the program's segments."""
        rows = []
        reached = int(segments[-1]) + 1
        for n in range(reached):
            mine = np.flatnonzero(segments == n)
            at_start = np.flatnonzero((segments == n) & (times == starts[n]))
            first = int(at_start[-1]) if at_start.size else int(mine[0]) - 1
            rows.append((first, int(mine[-1])))
        return cls(np.array(times), np.array(starts[:reached]), tuple(rows))

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
                knots = self.times[first : last + 1] - self.starts[n]
                out[mine] = _spline(knots, values[first : last + 1], times[mine] - self.starts[n])
        return out

    def moved(self, times: Floats, starts: Floats) -> Timeline:
        """The same steps at other times, the segments beginning at others too."""
        return Timeline(self.times + times, self.starts + starts, self.rows)


def _spline(knots: Floats, values: Floats, elapsed: Floats) -> Floats:
    """Values at times since the segment began."""
    if knots.size == 1:
        return np.repeat(values, elapsed.size, axis=0)
    return np.asarray(CubicSpline(np.log(knots + OFFSET), values)(np.log(elapsed + OFFSET)))
