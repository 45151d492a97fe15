"""Interpolation in time between the accepted steps of a simulation: splines that the core calculates."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from creepkit import core
from creepkit.arrays import ArrayLike, Floats, Ints
from creepkit.errors import SolveError
from creepkit.fem.solver import MOTION, PRESSURE, START
from creepkit.integration.time_discretisation import SMALLEST_EXPONENT

OFFSET = 20.0
"""s; twice the first step after a change of load. As in src/core/time_interpolation.hpp."""


@dataclass(frozen=True, eq=False)
class TimeInterpolation:
    """The accepted steps of a simulation.

    times : (steps,) s. starts : (segments reached,) s.
    rows : first and last step of each segment; without a jump of the load the first is the last one of the segment
        before.
    origins : (segments reached,) s, zero of the time y. exponents : (segments reached,) beta.
    """

    times: Floats
    starts: Floats
    rows: tuple[tuple[int, int], ...]
    origins: Floats
    exponents: Floats

    @classmethod
    def from_steps(cls, times: Floats, segments: Ints, program: Floats, beta: float = 1.0) -> TimeInterpolation:
        """From the rows of a record of steps.

        times : (steps,) s. segments : (steps,) number of each step's segment.
        program : (segments, 10) the load history, see fem.solver.LoadProgram.
        beta : the law's leading exponent of time.
        """
        reached = program[: int(segments[-1]) + 1]
        starts, numbers = reached[:, START].copy(), np.arange(len(reached))
        ends = zip(np.searchsorted(segments, numbers), np.searchsorted(segments, numbers, "right"), starts, strict=True)
        rows = [(int(a + np.count_nonzero(times[a:b] == start)) - 1, int(b) - 1) for a, b, start in ends]
        # a load that rises from nothing gives no power of time; long after zero only the change of load matters
        loaded = reached[:, [PRESSURE, MOTION]].any(axis=1)
        young = np.where(starts == 0.0, loaded, starts <= OFFSET) & (beta < 1.0)
        exponents = np.where(young, max(beta, SMALLEST_EXPONENT), 1.0)
        return cls(np.array(times), starts, tuple(rows), np.where(young, 0.0, starts), exponents)

    def interpolate(self, values: Floats, times: ArrayLike) -> Floats:
        """Values at other times, (times, ...); NaN after the last step.

        values : (steps, ...) in any unit, at the accepted steps. times : (times,) s, or one number.
        Each segment has a cubic spline with not-a-knot ends in ln(1 + (y / 20 s)^beta); a segment of one step has a
        straight line. At the time of a jump it is the value before it; at time zero the one after.
        """
        asked = np.ascontiguousarray(np.atleast_1d(np.asarray(times, float)))
        given = np.ascontiguousarray(values, dtype=float)
        if len(given) != self.times.size:
            raise ValueError(f"{len(given)} rows of values for {self.times.size} steps")
        out = np.empty((asked.size, *given.shape[1:]))
        check_interpolation(
            core.function("creepkit_interpolate_in_time")(
                *self.core_arguments, ctypes.c_int64(given[0].size), core.address(given), ctypes.c_int64(asked.size),
                core.address(asked), core.address(out),
            )
        )  # fmt: skip
        return out

    @property
    def core_arguments(self) -> tuple[ctypes.c_int64 | ctypes.c_void_p, ...]:
        """Steps, segments, times, starts, rows, origins and exponents, as functions of the core take them."""
        counts = ctypes.c_int64(self.times.size), ctypes.c_int64(self.starts.size)
        return *counts, *map(core.address, self._core_arrays)

    @cached_property
    def _core_arrays(self) -> tuple[Floats | Ints, ...]:
        """What `core_arguments` point to."""
        times, starts, origins, exponents = (
            np.ascontiguousarray(array, dtype=float)
            for array in (self.times, self.starts, self.origins, self.exponents)
        )
        return times, starts, np.array(self.rows, np.int64), origins, exponents


_INTERPOLATED, _NOT_INCREASING, _NO_MEMORY = 0, 2, 3


def check_interpolation(code: int) -> None:
    """Raise what a function of the core that interpolates in time has returned."""
    if code == _NO_MEMORY:
        raise MemoryError("no memory for the splines between the steps of a simulation")
    if code == _NOT_INCREASING:
        raise SolveError("the accepted steps of a simulation do not increase in time; they cannot be interpolated")
    if code != _INTERPOLATED:
        raise ValueError("the steps of a simulation and the segments of its load program do not belong together")
