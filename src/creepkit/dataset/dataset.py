"""Data sets: simulated tests of one law on one specimen, with the draws, the outputs and the reasons of rejection."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from creepkit.arrays import Bools, Floats, Ints
from creepkit.errors import quoted
from creepkit.records import History, Specimen, Status, outputs_of
from creepkit.records.presentable import Presentable
from creepkit.sampling.conditions import TimeGrid, planned_test, specimen_conditions

if TYPE_CHECKING:
    from creepkit.language import CreepLaw


class Column(NamedTuple):
    """An array whose first axis is the sample.

    file_type, memory_type : of its numbers. axes : the other axes, named for the sizes of a data set.
    chunk : samples that are compressed together.
    """

    file_type: type
    memory_type: type
    axes: tuple[str, ...] = ()
    chunk: int = 4096


COLUMNS = {
    "parameters": Column(np.float64, np.float64, ("parameter_names",), 256),
    "conditions": Column(np.float64, np.float64, ("condition_names",), 256),
    "values": Column(np.float32, np.float32, ("frames", "outputs"), 64),
    "hold_outputs": Column(np.float32, np.float32, ("holds", "outputs"), 256),
    "status": Column(np.int8, np.int64),
    "end_times": Column(np.float64, np.float64),
    "reasons": Column(np.int8, np.int64),
    "index": Column(np.int64, np.int64),
}


HOLD_TIMES = 4
"""Ends of the first ramp, of the first hold, of the second ramp, and of the test."""


def empty_columns(names: Mapping[str, Sequence[str]], frames: int) -> dict[str, Any]:
    """Every column without samples, {name: (0, ...)}; names : those of parameters, conditions and outputs."""
    sizes = {**{axis: len(several) for axis, several in names.items()}, "holds": HOLD_TIMES, "frames": frames}
    shapes = {name: tuple(sizes[axis] for axis in column.axes) for name, column in COLUMNS.items()}
    return {name: np.empty((0, *shapes[name]), column.memory_type) for name, column in COLUMNS.items()}


FAILED = -1
"""The reason of a sample whose simulation did not work; its text says why."""


NOT_SIMULATED = -1
"""The status of a sample that was rejected before it was simulated."""


@dataclass(frozen=True, eq=False)
class Dataset(Presentable):
    """Simulated tests: n samples of a law with its parameters and conditions.

    law, specimen : what was simulated. design_document : everything that decided what was drawn.
    grid : the times of the frames. outputs : names along the last axis of values.
    parameters : (n, P) the author's values, columns parameter_names; 0 = switched off where the law allows it.
    conditions : (n, C) in their units (MPa, s, mm, K ...); columns condition_names.
    values : (n, frames, outputs) in their units, float32, NaN after the end; all NaN where nothing was simulated.
    hold_outputs : (n, 4, outputs) in their units, float32, at the end of the first ramp, just before the jump, at the
        end of the second ramp and at the end of the test; NaN where the simulation ended before.
    status : (n,) records.Status, or -1 where nothing was simulated. end_times : (n,) s, where the simulation ended.
    reasons : (n,) 0 accepted, k the criterion reason_names[k] that was not met first, -1 failed.
    index : (n,) row of the Sobol sequence. reason_texts : what each criterion asks.
    failures : {row: text} of failed samples. provenance : versions, seed, when, fingerprint.
    """

    law: CreepLaw
    specimen: Specimen
    design_document: Mapping[str, Any]
    grid: TimeGrid
    outputs: tuple[str, ...]
    parameter_names: tuple[str, ...]
    condition_names: tuple[str, ...]
    parameters: Floats
    conditions: Floats
    values: NDArray[np.float32]
    hold_outputs: NDArray[np.float32]
    status: Ints
    end_times: Floats
    reasons: Ints
    reason_names: tuple[str, ...]
    index: Ints
    provenance: Mapping[str, Any]
    reason_texts: tuple[str, ...] = ()
    failures: Mapping[int, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.index)

    def __repr__(self) -> str:
        accepted = int((self.reasons == 0).sum())
        return f"<Dataset: {len(self)} samples of {self.law.name} on {self.specimen.name}, {accepted} accepted>"

    @property
    def accepted(self) -> Dataset:
        """The samples that met every criterion."""
        return self.rows(self.reasons == 0)

    def rows(self, selection: Sequence[int] | slice | Ints | Bools) -> Dataset:
        """The data set of some rows; selection : (k,) their numbers, a mask (rows,) or a slice."""
        numbers = np.arange(len(self))[selection]
        new_row = {int(old): new for new, old in enumerate(numbers)}
        columns = {name: getattr(self, name)[numbers] for name in COLUMNS}
        failures = {new_row[row]: text for row, text in self.failures.items() if row in new_row}
        return replace(self, **columns, failures=failures)

    def values_of(self, row: int) -> dict[str, float]:
        """The law's parameters of one sample."""
        return dict(zip(self.parameter_names, self.parameters[row].tolist(), strict=True))

    def theta_of(self, row: int) -> Floats:
        """The law's parameters of one sample as internal values, (1, parameters)."""
        return self.law.to_internal(self.parameters[row : row + 1])

    def conditions_of(self, row: int) -> dict[str, float]:
        """The conditions of one sample."""
        return dict(zip(self.condition_names, self.conditions[row].tolist(), strict=True))

    def planned_test(self, row: int) -> History:
        """The test of one sample, without outputs."""
        return planned_test(self.specimen, self.conditions_of(row), self.grid)

    def times(self, row: int) -> Floats:
        """(frames,) s, of one sample."""
        conditions = self.conditions_of(row)
        # a relative grid has no end of its own to fall back on
        end = conditions["end_time"] if "end_time" in conditions else self.grid.end  # noqa: SIM401
        return self.grid.times(end)

    shown_by = "surrogate.dataset_text"


def concatenate(parts: Sequence[Dataset]) -> Dataset:
    """The samples of data sets of one kind, one after the other; everything else is that of the first."""
    columns: dict[str, Any] = {name: np.concatenate([getattr(part, name) for part in parts]) for name in COLUMNS}
    offsets = np.cumsum([0, *(len(part) for part in parts)]).tolist()
    failures = {
        offset + row: text for offset, part in zip(offsets, parts, strict=False) for row, text in part.failures.items()
    }
    return replace(parts[0], **columns, failures=failures)


def first_difference(one: Any, other: Any, name: str) -> str:
    """Where two documents first differ: 'specimen.tolerance is 0.01 and 0.02'; '' when they do not.

    name : of both documents; "" when only their entries have names.
    """
    if isinstance(one, dict) and isinstance(other, dict):
        for key in sorted({*one, *other}):
            path = f"{name}.{key}" if name else key
            if key not in one or key not in other:
                return f"{path} is only in one of them"
            if difference := first_difference(one[key], other[key], path):
                return difference
        return ""
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        pairs = (first_difference(a, b, f"{name}[{k}]") for k, (a, b) in enumerate(zip(one, other, strict=True)))
        return next((found for found in pairs if found), "")
    return "" if one == other else f"{name} is {quoted(one, 60)} and {quoted(other, 60)}"


def summary(data: Dataset) -> dict[str, Any]:
    """Counts, reasons, ranges and provenance of a data set, as JSON-able data; ranges are those of accepted samples."""
    accepted = data.reasons == 0
    return {
        "law": data.law.name,
        "law_fingerprint": data.law.fingerprint,
        "specimen": data.specimen.name,
        "design": str(data.provenance.get("design", "unknown")),
        "samples": len(data),
        "accepted": int(accepted.sum()),
        "failed": int((data.reasons < 0).sum()),
        "simulated": int((data.status >= 0).sum()),
        "burst_accepted": int((data.status[accepted] == Status.RUPTURED).sum()),
        "reasons": rejection_counts(data),
        "failures": dict(Counter(data.failures.values()).most_common(5)),
        "frames": data.grid.frames,
        "times": dict(zip(("from", "to"), data.grid.values[[0, -1]].tolist(), strict=True))
        | {"relative": data.grid.relative},
        "ranges": dict(accepted_ranges(data)),
        "units": column_units(data),
        "provenance": dict(data.provenance),
    }


def rejection_counts(data: Dataset) -> list[dict[str, Any]]:
    """How many samples each criterion rejected, those that others had not; and how many of them without simulation."""
    pairs = list(zip(data.reason_names, data.reason_texts or data.reason_names, strict=True))[1:]
    not_simulated = data.status < 0
    return [
        {
            "criterion": name,
            "text": text,
            "rejected": int((data.reasons == k).sum()),
            "not_simulated": int((not_simulated & (data.reasons == k)).sum()),
        }
        for k, (name, text) in enumerate(pairs, start=1)
    ]


def accepted_ranges(data: Dataset) -> Iterator[tuple[str, dict[str, float]]]:
    """Least, middle and largest value of every parameter, condition and last output of the accepted samples."""
    functions: dict[str, Any] = {"least": np.min, "median": np.median, "most": np.max}
    for name, column in summary_columns(data):
        values = column[(data.reasons == 0) & np.isfinite(column)]
        if values.size:
            yield name, {word: float(function(values)) for word, function in functions.items()}


def summary_columns(data: Dataset) -> Iterator[tuple[str, Floats]]:
    """Parameters, conditions and last outputs of the samples: (name, (n,) in the unit of column_units())."""
    for names, values in ((data.parameter_names, data.parameters), (data.condition_names, data.conditions)):
        yield from ((name, values[:, k]) for k, name in enumerate(names))
    yield "end of simulation", np.where(data.status >= 0, data.end_times, np.nan)
    for k, name in enumerate(data.outputs):
        yield f"last {name}", last_values(data.values[..., k])


def last_values(values: Any) -> Floats:
    """(n,) last finite value of each row, NaN where there is none.

    values : (n, frames).
    """
    finite = np.isfinite(values)
    frame = values.shape[1] - 1 - np.argmax(finite[:, ::-1], axis=1)
    return np.where(finite.any(axis=1), values[np.arange(len(values)), frame], np.nan).astype(float)


def column_units(data: Dataset) -> dict[str, str]:
    """{name: unit} of every column of `ranges`; "" of a pure number."""
    known, stated = specimen_conditions(data.specimen), {str(o): o.unit for o in outputs_of(data.specimen)}
    units = {name: param.unit for name, param in data.law.table.items()}
    units |= {name: known.unit(name) for name in data.condition_names}
    return units | {"end of simulation": "s"} | {f"last {name}": stated.get(name, "") for name in data.outputs}
