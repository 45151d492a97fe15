"""From rows of a design to a data set: draw, judge, simulate, judge again. One sample at a time, on one thread."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from creepkit.arrays import Ints
from creepkit.dataset.columns import MARKS, nothing
from creepkit.dataset.conditions import mark_times, plan
from creepkit.dataset.criteria import Outcome
from creepkit.dataset.dataset import FAILED, NOT_SIMULATED, Dataset
from creepkit.dataset.sketching import ruled_out
from creepkit.errors import CreepkitError, DatasetError
from creepkit.records import Status

if TYPE_CHECKING:
    from creepkit.dataset.design import Design, Draws
    from creepkit.records import Specimen

TOO_MANY_FAILURES = 8
"""Samples of a shard of which all fail: something is wrong with all of them, and nobody wants a file of that."""

DIGITS = 12
"""Of the histories of rejected samples: 1 part in 4000, for a look at what was rejected, not for learning."""


class SampleFailed(Exception):
    """A simulation that left nothing; its text is kept."""


def header_of(design: Design, specimen: Specimen, provenance: dict[str, object]) -> Dataset:
    """The data set of a design with no samples in it yet."""
    sizes = {
        "parameter_names": len(design.law.names),
        "condition_names": len(design.condition_names),
        "outputs": len(specimen.outputs),
        "frames": design.grid.frames,
        "marks": MARKS,
    }
    return Dataset(
        law=design.law,
        specimen=specimen,
        design_document=design.document(),
        grid=design.grid,
        outputs=tuple(specimen.outputs),
        parameter_names=tuple(design.law.names),
        condition_names=tuple(design.condition_names),
        reason_names=("accepted", *(c.name for c in design.criteria)),
        reason_texts=("all criteria are met", *(c.text for c in design.criteria)),
        provenance=provenance,
        **nothing(sizes),
    )


def simulate(
    design: Design, header: Dataset, seed: int, first: int, count: int, starting: Callable[[int], None]
) -> Dataset:
    """Rows first to first + count of a design, simulated.

    starting : called with the row that is about to be simulated; may raise SampleFailed.
    """
    draws = design.draw(first, count, seed)
    samples = _drawn(header, draws, _reasons_before(design, draws), first)
    samples.reasons[:] += ruled_out(design, samples)
    failures: dict[int, str] = {}
    for tried, row in enumerate(np.flatnonzero(samples.reasons == 0).tolist(), start=1):
        try:
            starting(first + row)
            samples.reasons[row] = _simulated(design, samples, row)
        except (MemoryError, OSError):
            raise
        except Exception as error:  # a failed sample is data, whatever a law or a specimen of a plugin raises
            samples.reasons[row] = FAILED
            failures[row] = words(error)
            if len(failures) == tried == TOO_MANY_FAILURES:
                raise DatasetError(f"the first {tried} simulations all failed: {failures[row]}") from error
    rejected = samples.reasons != 0
    samples.values[rejected] = shortened(samples.values[rejected])
    return replace(samples, failures=failures)


def shortened(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """The same to DIGITS binary digits, which take a third of the room in a compressed file."""
    fractions, exponents = np.frexp(values)
    return np.asarray(np.ldexp(np.round(fractions * 2**DIGITS) / 2**DIGITS, exponents), dtype=np.float32)


def _reasons_before(design: Design, draws: Draws) -> Ints:
    """The first criterion that a draw does not meet, 0 where it meets all that need no simulation."""
    reasons = np.zeros(len(draws), dtype=np.int64)
    for number, criterion in enumerate(design.criteria, start=1):
        if criterion.stage == "before":
            met = criterion.passes(design.law, draws)
            reasons[(reasons == 0) & ~met] = number
    return reasons


def _drawn(header: Dataset, draws: Draws, reasons: Ints, first: int) -> Dataset:
    """Samples with nothing simulated yet."""
    rows = len(draws)

    def unknown(name: str) -> NDArray[np.float32]:
        return np.full((rows, *getattr(header, name).shape[1:]), np.nan, dtype=np.float32)

    return replace(
        header,
        parameters=np.array(draws.parameters),
        conditions=np.array(draws.conditions),
        values=unknown("values"),
        marks=unknown("marks"),
        status=np.full(rows, NOT_SIMULATED, dtype=np.int64),
        end_times=np.zeros(rows),
        reasons=reasons,
        index=np.arange(first, first + rows, dtype=np.int64),
    )


def _simulated(design: Design, samples: Dataset, row: int) -> int:
    """Simulate one sample, write its history into its row and return its reason."""
    conditions = samples.conditions_of(row)
    test = plan(samples.specimen, conditions, design.grid)
    at = mark_times(test)
    times = np.union1d(test.times, at)
    found = samples.specimen.predict(samples.law, samples.values_of(row), [test.replace(times=times)])
    seen = found.of(0)
    outputs = np.full(samples.values.shape[1:], np.nan)
    outputs[: test.times.size] = seen[np.searchsorted(times, test.times)]
    marks = seen[np.searchsorted(times, at)]
    status, end = Status(int(found.status[0, 0])), float(found.end_times[0, 0])
    samples.values[row], samples.marks[row] = outputs, marks
    samples.status[row], samples.end_times[row] = status, end
    if status == Status.NOT_CONVERGED and not np.isfinite(seen[times > 0, 0]).any():
        raise SampleFailed(f"not converged from {end:g} s on, with nothing to show before")
    outcome = Outcome(test.times, outputs[: test.times.size], marks, status, end, conditions)
    return _reason_after(design, outcome)


def _reason_after(design: Design, outcome: Outcome) -> int:
    for number, criterion in enumerate(design.criteria, start=1):
        if criterion.stage == "after" and not criterion.passes(outcome):
            return number
    return 0


def words(error: Exception) -> str:
    """One line on what happened; errors that are not ours are named."""
    text = " ".join(str(error).split())
    if isinstance(error, CreepkitError | SampleFailed):
        return text
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
