"""Time discretisation of creep: Runge-Kutta tableaux and the segments of a load program.

The tableaux are diagonally implicit and stiffly accurate. Within each segment of the load program steps are taken in a
transformed time in which creep strain is nearly a straight line (`time_transformation.hpp`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Floats
from creepkit.records import Program

SMALLEST_EXPONENT = 0.05
"""Exponents of time are not taken below this: t^m with m = -0.95, where the laws' bounds stop."""


class Tableau(NamedTuple):
    """A singly diagonally implicit Runge-Kutta method whose last stage is the end of the step.

    a : (stages, stages) lower triangular, constant diagonal gamma; its last row holds the weights.
    c : (stages,) places of the stages in the step.
    error : (stages,) weights less the embedded weights: error = h sum error_i k_i.
    dense : (stages, degree) b_i(x) = sum_q dense_iq x^(q+1), the weights up to the share x of the step.
    order : of the step; error_order : of the embedded solution; dense_order : of the dense output.
    """

    a: Floats
    c: Floats
    error: Floats
    dense: Floats
    order: int
    error_order: int
    dense_order: int

    @property
    def gamma(self) -> float:
        """The constant diagonal."""
        return float(self.a[0, 0])

    @property
    def stages(self) -> int:
        """Number of stages."""
        return int(self.c.size)


def _tableau(
    rows: Sequence[Sequence[float]],
    embedded: Sequence[float],
    dense: Sequence[Sequence[float]],
    orders: tuple[int, int, int],
) -> Tableau:
    a = np.array([list(row) + [0.0] * (len(rows) - len(row)) for row in rows])
    return Tableau(a, a.sum(axis=1), a[-1] - np.array(embedded), np.array(dense), *orders)


_ALEXANDER = 1.0 - np.sqrt(0.5)


SDIRK2 = _tableau(
    rows=[[_ALEXANDER], [1.0 - _ALEXANDER, _ALEXANDER]],
    embedded=[1.0, 0.0],
    dense=[[np.sqrt(2.0), -np.sqrt(0.5)], [1.0 - np.sqrt(2.0), np.sqrt(0.5)]],
    orders=(2, 1, 2),
)
"""Two stages, order 2, L-stable: Alexander (1977), SIAM J. Numer. Anal. 14, 1006.

The embedded solution is the first stage's slope over the whole step; the dense output is the one quadratic that
meets the conditions of order 2 at every place.
"""


SDIRK2_TEXT = (
    "a singly diagonally implicit Runge-Kutta method of two stages and order 2, L-stable (R. Alexander (1977), SIAM J. "
    "Numer. Anal. 14, 1006)"
)
"""SDIRK2 in words."""


SDIRK4 = _tableau(
    rows=[
        [1 / 4],
        [1 / 2, 1 / 4],
        [17 / 50, -1 / 25, 1 / 4],
        [371 / 1360, -137 / 2720, 15 / 544, 1 / 4],
        [25 / 24, -49 / 48, 125 / 16, -85 / 12, 1 / 4],
    ],
    embedded=[59 / 48, -17 / 96, 225 / 32, -85 / 12, 0.0],
    dense=[
        [11 / 3, -463 / 72, 217 / 36, -20 / 9],
        [11 / 2, -385 / 16, 661 / 24, -10.0],
        [-125 / 18, 20125 / 432, -8875 / 216, 250 / 27],
        [0.0, -85 / 4, 85 / 6, 0.0],
        [-11 / 9, 557 / 108, -359 / 54, 80 / 27],
    ],
    orders=(4, 3, 3),
)
"""Five stages, order 4 with embedded order 3, L-stable: Hairer and Wanner, Solving ODEs II, section IV.6, (6.16-6.17).

The dense output is the one quartic that meets the conditions of order 3, and of order 4 for quadrature, everywhere.
"""


SDIRK4_TEXT = (
    "an L-stable singly diagonally implicit Runge-Kutta method of five stages and order 4, with one of order 3 "
    "embedded. See Hairer and Wanner, Solving Ordinary Differential Equations II, IV.6"
)
"""SDIRK4 in words."""


def merge_programs(*programs: Program, end: float) -> Floats:
    """Merge programs from 0 to `end` (s) into segments, (segments, 2 + 2 programs); every breakpoint is a boundary.

    Columns: start and end, s, then the values of each program at both, in the program's unit.
    """
    marks = np.concatenate([*(program.times for program in programs), [0.0, end]])
    marks = np.unique(marks[marks <= end])
    starts, ends = marks[:-1], marks[1:]
    columns = [starts, ends]
    for program in programs:
        columns += [program.at(starts), program.before(ends)]
    return np.ascontiguousarray(np.stack(columns, axis=1))
