"""Single readings of tests of few readings, which say too little of their noise for `outlier_frames`.

A piece under a held load does not recover: one reading that alone makes its output fall, by far more than others miss
one another, is a slip of the pen. A reading that repeats the one before to a digit, where those beside it lead to a
hundred digits more, was copied, or its gauge stuck.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from creepkit.arrays import Floats
from creepkit.quality.flags import QualityFlag
from creepkit.quality.frames import FEWEST_FRAMES, grows, load_segments
from creepkit.quality.repeats import last_digits
from creepkit.records import History, growing_output
from creepkit.records.units import time_text

FEWEST, GROSS, LEFT, MISSES, CLEARLY = 5, 0.1, 0.1, 10.0, 3.0
"""Readings from which one is judged; fall over the range of the others, part of the fall that these have without it,
times that the reading misses them as they miss one another, and that it is further off than the other one that may be
meant at an end. Of planted curves none is flagged whose noise is 0.3 % of its range, and one in forty where it is 10 %
(test_few_readings)."""


COPIED_DIGITS, COPIED_PART = 100.0, 0.02
"""Last digits, and part of the range, by which an output grows between two readings that are the same."""


STEADY = 0.5
"""Of the rate beside it: a lower one shows creep that accelerates at its beginning, or dies away at its end."""


def doubtful_readings(history: History) -> Iterator[QualityFlag]:
    """Of the parts of FEWEST_FRAMES readings or fewer under one load, that which is far off, and copies."""
    for segment in load_segments(history) if grows(history) else ():
        if not FEWEST <= segment.frames.size <= FEWEST_FRAMES or not segment.load_increased:
            continue
        t, y = history.times[segment.frames], history.outputs[growing_output(history)][segment.frames]
        found = dict[int, str]()
        if (k := gross_outlier(t, y)) is not None:
            found[k] = f"off its neighbours by {abs(_misses(t, y, [k])[0]):.2g}, and no held load takes that back"
        for k in (np.flatnonzero((y[1:] == y[:-1]) & (_growth_between(t, y) > _least_growth(y))) + 1).tolist():
            found[k] = f"the reading of {time_text(float(t[k - 1]))} again, amid growth: copied, or the gauge stuck"
        for k, what in found.items():
            yield QualityFlag.of_frames(history, "outlier", segment.frames[[k]], f"at {time_text(float(t[k]))} {what}")


def gross_outlier(t: Floats, y: Floats) -> int | None:
    """The one reading that makes an output fall that should grow; None where there is none.

    t : (readings,) s. y : (readings,) the output.
    """
    fall = _fall(y)
    either = [k for k in range(y.size) if _fall(np.delete(y, k)) <= LEFT * fall]
    if fall == 0.0 or not 0 < len(either) < 3:
        return None
    beside = np.delete(np.arange(y.size), either)  # at an end the fall may be of either of two
    near = [beside[np.argsort(np.abs(beside - k))[:2]] for k in either]
    off = [abs(y[k] - np.polyval(np.polyfit(t[two], y[two], 1), t[k])) for k, two in zip(either, near, strict=True)]
    if len(off) > 1 and max(off) < CLEARLY * min(off):
        return None
    k = either[int(np.argmax(off))]
    others = np.delete(np.arange(y.size), k)
    usual = np.median(np.abs(_misses(t[others], y[others], range(1, others.size - 1))))
    is_gross = fall > GROSS * np.ptp(y[others]) and abs(_misses(t, y, [k])[0]) > MISSES * usual
    return k if is_gross else None


def _fall(y: Floats) -> float:
    return float((np.maximum.accumulate(y) - y).max())


def _misses(t: Floats, y: Floats, readings: Sequence[int]) -> Floats:
    """By how much readings miss lines between those beside them, over time or its logarithm, whichever fits better."""

    def of(x: Floats) -> Floats:
        return np.array([y[k] - np.interp(x[k], np.delete(x, k), np.delete(y, k)) for k in readings])

    return min(of(t), of(np.log(t)), key=lambda one: float(np.median(np.abs(one))))


def _growth_between(t: Floats, y: Floats) -> Floats:
    """(readings - 1,) growth from one reading to the next by the readings around both; 0 where nothing shows it.

    From the first on by the two rates behind it, unless creep accelerates; up to the last by the growth over ln time
    before it, unless creep dies away.
    """
    growth, rates = np.zeros(y.size - 1), np.diff(y) / np.diff(t)
    growth[1:-1] = np.minimum(rates[2:], rates[:-2]) * np.diff(t)[1:-1]
    growth[0] = rates[2] * (t[1] - t[0]) if rates[1] >= STEADY * rates[2] else 0.0
    if t[-4] > 0.0:
        steps = np.diff(np.log(t[-4:]))
        before, last = np.diff(y[-4:-1]) / steps[:2]
        growth[-1] = min(before, last) * steps[2] if last >= STEADY * before else 0.0
    return growth


def _least_growth(y: Floats) -> float:
    return max(COPIED_DIGITS * float(np.median(last_digits(y))), COPIED_PART * float(np.ptp(y)))
