"""Simulation of the rows of a sampling design, one at a time on one thread, and the acceptance criteria."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Ints
from creepkit.dataset.dataset import FAILED, NOT_SIMULATED, Dataset, empty_columns
from creepkit.errors import DatasetError
from creepkit.jobs.worker_process import error_text
from creepkit.records import Specimen, Status
from creepkit.sampling.conditions import creep_output, hold_times
from creepkit.sampling.domains import DrawCriterion, OutcomeCriterion, SamplingDomain, SimulationOutcome

if TYPE_CHECKING:
    from creepkit.sampling.rates import Draws


def _outcome(samples: Dataset, row: int) -> SimulationOutcome:
    """The outcome of one sample, at the frames of its test and when its holds begin and end."""
    test = samples.planned_test(row)
    hold_instants = hold_times(test)
    times = np.union1d(test.times, hold_instants)
    prediction = samples.specimen.predict(samples.law, samples.theta_of(row), [test.replace(times=times)])
    observed, shown = prediction.of(0), creep_output(samples.specimen)
    outputs, hold_outputs = (observed[np.searchsorted(times, t)] for t in (test.times, hold_instants))
    status, end_time = Status(int(prediction.status[0, 0])), float(prediction.end_times[0, 0])
    if status == Status.NOT_CONVERGED and not np.isfinite(observed[times > 0, shown.column]).any():
        raise DatasetError(f"not converged from {end_time:g} s on, with nothing to show before")
    conditions = samples.conditions_of(row)
    return SimulationOutcome(test.times, outputs, hold_outputs, status, end_time, conditions, shown.column, shown.falls)


TOO_MANY_FAILURES = 8
"""First samples of a shard after whose failure, all of them, the shard is given up."""


def empty_dataset(design: SamplingDomain, specimen: Specimen, provenance: dict[str, object]) -> Dataset:
    """The data set of a design with no samples in it yet."""
    names: dict[str, Any] = {
        "outputs": tuple(specimen.outputs),
        "parameter_names": tuple(design.law.names),
        "condition_names": tuple(design.condition_names),
        "reason_names": ("accepted", *(c.name for c in design.criteria)),
        "reason_texts": ("all criteria are met", *(c.text for c in design.criteria)),
    }
    columns = empty_columns(names, design.grid.frames)
    return Dataset(design.law, specimen, design.document(), design.grid, provenance=provenance, **names, **columns)


def simulate_rows(design: SamplingDomain, header: Dataset, seed: int, first: int, count: int) -> Dataset:
    """Rows first to first + count of a design, simulated."""
    draws = design.draw(first, count, seed)
    samples = _unsimulated(header, draws, _reasons_before(design, draws), first)
    failures: dict[int, str] = {}
    criteria = [(k, one) for k, one in enumerate(design.criteria, start=1) if isinstance(one, OutcomeCriterion)]
    for attempt, row in enumerate(np.flatnonzero(samples.reasons == 0).tolist(), start=1):
        try:
            outcome = _outcome(samples, row)
            samples.values[row, : outcome.times.size], samples.hold_outputs[row] = outcome.outputs, outcome.hold_outputs
            samples.status[row], samples.end_times[row] = outcome.status, outcome.end_time
            samples.reasons[row] = next((k for k, one in criteria if not one.passes(outcome)), 0)
        except (MemoryError, OSError):
            raise
        except Exception as error:  # a failed sample is data, whatever a law or a specimen of a plugin raises
            samples.reasons[row] = FAILED
            failures[row] = error_text(error)
            if len(failures) == attempt == TOO_MANY_FAILURES:
                raise DatasetError(f"the first {attempt} simulations all failed: {failures[row]}") from error
    return replace(samples, failures=failures)


def _reasons_before(design: SamplingDomain, draws: Draws) -> Ints:
    """The first criterion that a draw does not meet, 0 where it meets all that need no simulation."""
    reasons = np.zeros(len(draws), dtype=np.int64)
    for number, criterion in enumerate(design.criteria, start=1):
        if isinstance(criterion, DrawCriterion):
            reasons[(reasons == 0) & ~criterion.passes(design.law, draws)] = number
    return reasons


def _unsimulated(header: Dataset, draws: Draws, reasons: Ints, first: int) -> Dataset:
    """Samples that are not simulated yet, with the reasons of those rejected before."""
    rows = len(draws)
    empty = {name: (rows, *getattr(header, name).shape[1:]) for name in ("values", "hold_outputs")}
    nothing: dict[str, Any] = {name: np.full(shape, np.nan, np.float32) for name, shape in empty.items()}
    return replace(
        header,
        parameters=np.array(draws.parameters),
        conditions=np.array(draws.conditions),
        status=np.full(rows, NOT_SIMULATED, dtype=np.int64),
        end_times=np.zeros(rows),
        reasons=reasons,
        index=np.arange(first, first + rows, dtype=np.int64),
        **nothing,
    )
