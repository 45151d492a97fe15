"""Whether a test creeps: growth of an output while its load is held, against the noise."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Bools, Ints
from creepkit.inverse.scales import noise_of, usable
from creepkit.records import History

LEVEL = 0.02
"""Relative change of a load within which it is held."""
FEWEST = 6
"""Frames of a hold that say something of growth."""
SURE = 5.0
"""Standard errors that a growth must exceed; and it must exceed the noise of one frame."""


@dataclass(frozen=True)
class Growth:
    """By how much an output grows during the holds, its standard error, and the noise of a frame, in its unit.

    All are NaN where no hold has frames enough.
    """

    value: float
    error: float
    noise: float

    @property
    def visible(self) -> bool:
        """Whether it is creep; true also where nothing can be said."""
        return not self.value <= max(SURE * self.error, self.noise)


def growth(history: History, output: str) -> Growth:
    """Mean of the last third of each hold less that of its first, summed over holds."""
    noise = float(np.median(noise_of(history, output)))
    values, parts = history.outputs[output], list(_holds(history, usable(history, output)))
    if not parts:
        return Growth(float("nan"), float("nan"), noise)
    thirds = [np.array_split(mine, 3) for mine in parts]
    grown = sum(float(values[last].mean() - values[first].mean()) for first, _, last in thirds)
    variance = sum(1.0 / first.size + 1.0 / last.size for first, _, last in thirds)
    return Growth(grown, noise * float(np.sqrt(variance)), noise)


def levels(histories: Sequence[History]) -> list[float]:
    """The loads at the used frames of tests, one for all that lie within 2 % of it."""
    found: list[float] = []
    for history in histories:
        program = history.loading.program()
        for load in np.interp(history.times[history.used], program.times, program.values):
            if load > 0 and not any(abs(load - level) <= LEVEL * level for level in found):
                found.append(float(load))
    return found


def _holds(history: History, used: Bools) -> Iterator[Ints]:
    """The frames of each hold of the load that has enough of them."""
    frames = np.flatnonzero(used)
    program = history.loading.program()
    load = np.interp(history.times[frames], program.times, program.values)
    start = 0
    for k in range(1, frames.size + 1):
        if k == frames.size or abs(load[k] - load[start]) > LEVEL * abs(load[start]):
            if k - start >= FEWEST:
                yield frames[start:k]
            start = k
