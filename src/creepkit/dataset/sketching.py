"""Samples that need no simulation: the specimen's cheap stand-in says beforehand that they will be rejected.

In the paper's box a third of the simulations burst long before they could be of use, and take most of the time. Where a
specimen has a stand-in (see records.Screened) it is asked first, and what bursts far too early there (see criteria) is
left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Ints
from creepkit.dataset.conditions import hold_times, planned_test
from creepkit.dataset.criteria import CreepInEachHold, SurvivesTime, SimulationOutcome
from creepkit.records import Predictor, SupportsReducedOrderModel, Status

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset
    from creepkit.dataset.design import SamplingDesign


def rejected_by_screening(design: SamplingDesign, samples: Dataset) -> Ints:
    """(rows,) the number of the criterion that a sample cannot meet, 0 where it must be simulated to know."""
    reasons = np.zeros(len(samples), dtype=np.int64)
    if not getattr(design, "screened", False) or not isinstance(samples.specimen, SupportsReducedOrderModel):
        return reasons
    reduced_model = samples.specimen.reduced_order_model()
    for row in np.flatnonzero(samples.reasons == 0).tolist():
        try:
            reasons[row] = _first_rejection(design, _screening_outcome(design, samples, row, reduced_model))
        except (MemoryError, OSError):
            raise
        except Exception:
            continue  # whatever a law of a plugin raises: its simulation comes next, and says it
    return reasons


def _screening_outcome(design: SamplingDesign, samples: Dataset, row: int, reduced_model: Predictor) -> SimulationOutcome:
    """What the stand-in makes of one sample, looked at when the holds begin and end."""
    conditions = samples.conditions_of(row)
    test = planned_test(samples.specimen, conditions, design.grid)
    hold_instants = hold_times(test)
    times = np.unique(hold_instants)
    prediction = reduced_model.predict(samples.law, samples.values_of(row), [test.replace(times=times)])
    outputs = prediction.of(0)
    status, end_time = Status(int(prediction.status[0, 0])), float(prediction.end_times[0, 0])
    return SimulationOutcome(times, outputs, outputs[np.searchsorted(times, hold_instants)], status, end_time, conditions)


def _first_rejection(design: SamplingDesign, screening_outcome: SimulationOutcome) -> int:
    for number, criterion in enumerate(design.criteria, start=1):
        if isinstance(criterion, SurvivesTime | CreepInEachHold) and criterion.rejects_early(screening_outcome):
            return number
    return 0
