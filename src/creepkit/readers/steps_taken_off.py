"""Steps of the outputs that a head or a file of answers has taken off: `steps_taken_off: 36.75 h; 120 h`.

An extensometer that was bumped or set anew, as in an interruption, adds a step to all later readings. Its size is the
distance, midway between the frames around it, of straight lines through the frames before and after it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.errors import HistoryError
from creepkit.readers.column_names import unit_suffix
from creepkit.readers.conditions import StatedConditions
from creepkit.readers.table import SourceText
from creepkit.records.quantities import TIME
from creepkit.records.units import time_text

FITTED_FRAMES = 6
"""Frames on either side of a step through which a straight line is laid."""


def without_steps(
    conditions: StatedConditions, times: Floats, outputs: Mapping[str, Floats], used: Bools
) -> dict[str, Floats]:
    """The outputs (frames,) without the steps that are to be taken off, each of which is recorded with its size.

    times : (frames,) s. outputs : {name: (frames,)}. used : (frames,) those that a line may be laid through.
    """
    results = dict(outputs)
    entry = conditions.take_entry("steps_taken_off")
    if entry is None:
        return results
    for time in _times_in(entry):
        first = int(np.searchsorted(times, time * (1 - 1e-9)))
        if not 0 < first < times.size:
            raise HistoryError(f"{entry.location}: no frames lie before and after a step at {time_text(time)}")
        middle = 0.5 * (times[first - 1] + times[first])
        indices = np.arange(times.size)
        before, after = indices[used & (indices < first)], indices[used & (indices >= first)]
        sizes = list[str]()
        for name, values in results.items():
            ends = [_line_at(middle, times, values, one) for one in (before[-FITTED_FRAMES:], after[:FITTED_FRAMES])]
            results[name] = np.where(indices >= first, values - (ends[1] - ends[0]), values)
            sizes.append(f"{ends[1] - ends[0]:.3g} of {name}")
        conditions.record_assumption(f"a step of {' and '.join(sizes)} at {time_text(time)} taken off")
    return results


def _times_in(entry: SourceText) -> list[float]:
    """s; HistoryError for what is no times with units."""
    times = list[float]()
    for item in entry.text.split(";"):
        number, _, unit = item.strip().partition(" ")
        suffix = unit_suffix(unit)
        if suffix is None or suffix not in TIME.units:
            what = f"steps_taken_off is '{entry.text}'; write times such as 36.75 h; 120 h"
            raise HistoryError(f"{entry.location}: {what}")
        value = SourceText(number, entry.location).number("steps_taken_off")
        times.append(TIME.convert(value, suffix, entry.location, "steps_taken_off"))
    return sorted(times)


def _line_at(time: float, times: Floats, values: Floats, frames: Ints) -> float:
    """A straight line through some frames, a mean of few, at a time."""
    if frames.size < 3:
        return float(np.mean(values[frames])) if frames.size else 0.0
    return float(np.polynomial.Polynomial.fit(times[frames], values[frames], 1)(time))
