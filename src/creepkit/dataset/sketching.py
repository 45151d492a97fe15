"""Samples that need no simulation: the specimen's cheap stand-in says beforehand that they will be rejected.

In the paper's box a third of the simulations burst long before they could be of use, and take most of the time. Where a
specimen has a stand-in (see records.Screened) it is asked first, and what bursts far too early there (see criteria) is
left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Ints
from creepkit.dataset.conditions import mark_times, plan
from creepkit.dataset.criteria import GrowsInEachHold, Lasts, Outcome
from creepkit.records import Predictor, Screened, Status

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset
    from creepkit.dataset.design import Design


def ruled_out(design: Design, samples: Dataset) -> Ints:
    """(rows,) the number of the criterion that a sample cannot meet, 0 where it must be simulated to know."""
    reasons = np.zeros(len(samples), dtype=np.int64)
    if not getattr(design, "screened", False) or not isinstance(samples.specimen, Screened):
        return reasons
    stand_in = samples.specimen.screening()
    for row in np.flatnonzero(samples.reasons == 0).tolist():
        try:
            reasons[row] = _first(design, _sketch(design, samples, row, stand_in))
        except (MemoryError, OSError):
            raise
        except Exception:
            continue  # whatever a law of a plugin raises: its simulation comes next, and says it
    return reasons


def _sketch(design: Design, samples: Dataset, row: int, stand_in: Predictor) -> Outcome:
    """What the stand-in makes of one sample, looked at when the holds begin and end."""
    conditions = samples.conditions_of(row)
    test = plan(samples.specimen, conditions, design.grid)
    at = mark_times(test)
    times = np.unique(at)
    found = stand_in.predict(samples.law, samples.values_of(row), [test.replace(times=times)])
    seen = found.of(0)
    status, end = Status(int(found.status[0, 0])), float(found.end_times[0, 0])
    return Outcome(times, seen, seen[np.searchsorted(times, at)], status, end, conditions)


def _first(design: Design, sketch: Outcome) -> int:
    for number, criterion in enumerate(design.criteria, start=1):
        if isinstance(criterion, Lasts | GrowsInEachHold) and criterion.rules_out(sketch):
            return number
    return 0
