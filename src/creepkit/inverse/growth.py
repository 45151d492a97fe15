"""Whether a test creeps: growth of an output while its load is held, against the noise."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Bools, Ints
from creepkit.inverse.scales import noise_standard_deviation, usable_frames
from creepkit.records import History

LOAD_TOLERANCE = 0.02
"""Relative change of a load within which it is held."""
MINIMUM_FRAMES = 6
"""Frames of a hold that say something of growth."""
SIGNIFICANT_ERRORS = 5.0
"""Standard errors that a growth must exceed; and it must exceed the noise of one frame."""


@dataclass(frozen=True)
class CreepDetection:
    """By how much an output grows during the holds, its standard error, and the noise of a frame, in its unit.

    All are NaN where no hold has frames enough.
    """

    increase: float
    standard_error: float
    noise: float

    @property
    def shows_creep(self) -> bool:
        """Whether it is creep; true also where nothing can be said."""
        return not self.increase <= max(SIGNIFICANT_ERRORS * self.standard_error, self.noise)


def detect_creep(history: History, output: str) -> CreepDetection:
    """Mean of the last third of each hold less that of its first, summed over holds."""
    noise = float(np.median(noise_standard_deviation(history, output)))
    values, holds = history.outputs[output], list(_load_holds(history, usable_frames(history, output)))
    if not holds:
        return CreepDetection(float("nan"), float("nan"), noise)
    thirds = [np.array_split(frames, 3) for frames in holds]
    increase = sum(float(values[last_third].mean() - values[first_third].mean()) for first_third, _, last_third in thirds)
    variance = sum(1.0 / first.size + 1.0 / last.size for first, _, last in thirds)
    return CreepDetection(increase, noise * float(np.sqrt(variance)), noise)


def distinct_loads(histories: Sequence[History]) -> list[float]:
    """The loads at the used frames of tests, one for all that lie within 2 % of it."""
    loads: list[float] = []
    for history in histories:
        program = history.loading.program()
        for load in np.interp(history.times[history.used], program.times, program.values):
            if load > 0 and not any(abs(load - level) <= LOAD_TOLERANCE * level for level in loads):
                loads.append(float(load))
    return loads


def _load_holds(history: History, used: Bools) -> Iterator[Ints]:
    """The frames of each hold of the load that has enough of them."""
    frames = np.flatnonzero(used)
    program = history.loading.program()
    load = np.interp(history.times[frames], program.times, program.values)
    start = 0
    for k in range(1, frames.size + 1):
        if k == frames.size or abs(load[k] - load[start]) > LOAD_TOLERANCE * abs(load[start]):
            if k - start >= MINIMUM_FRAMES:
                yield frames[start:k]
            start = k
