"""A data set: simulated tests of one law on one specimen, with what was drawn, what came out and why some fell out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from creepkit.arrays import Bools, Floats, Ints
from creepkit.dataset.columns import COLUMNS
from creepkit.dataset.conditions import planned_test
from creepkit.dataset.describe import dataset_text
from creepkit.dataset.joining import join
from creepkit.errors import DatasetError

if TYPE_CHECKING:
    from creepkit.dataset.time_grid import TimeGrid
    from creepkit.language import CreepLaw
    from creepkit.records import History, Specimen

FAILED = -1
"""The reason of a sample whose simulation did not work; its text says why."""
NOT_SIMULATED = -1
"""The status of a sample that was rejected before it was simulated."""


@dataclass(frozen=True, eq=False)
class Dataset:
    """Simulated tests: n samples of a law with its parameters and conditions.

    law, specimen : what was simulated. design_document : everything that decided what was drawn.
    grid : the times of the frames. outputs : names along the last axis of values.
    parameters : (n, P) the author's values, columns parameter_names; 0 = switched off where the law allows it.
    conditions : (n, C) MPa, s, mm, K; columns condition_names.
    values : (n, frames, outputs) float32, NaN after the end; all NaN where nothing was simulated.
    marks : (n, 4, outputs) float32 at the end of the first ramp, just before the jump, at the end of the second ramp
        and at the end of the test; NaN where the simulation did not get.
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

    def __str__(self) -> str:
        return dataset_text(self)

    def __repr__(self) -> str:
        accepted = int((self.reasons == 0).sum())
        return f"<Dataset: {len(self)} samples of {self.law.name} on {self.specimen.name}, {accepted} accepted>"

    @property
    def accepted(self) -> Dataset:
        """The samples that met every criterion."""
        return self.rows(self.reasons == 0)

    def rows(self, selection: Sequence[int] | slice | Ints | Bools) -> Dataset:
        """The data set of some rows, by their numbers or a mask."""
        numbers = np.arange(len(self))[selection]
        new_row = {int(old): new for new, old in enumerate(numbers)}
        columns = {name: getattr(self, name)[numbers] for name in COLUMNS}
        failures = {new_row[row]: text for row, text in self.failures.items() if row in new_row}
        return replace(self, **columns, failures=failures)

    def values_of(self, row: int) -> dict[str, float]:
        """The law's parameters of one sample."""
        return dict(zip(self.parameter_names, self.parameters[row].tolist(), strict=True))

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

    def output(self, name: str) -> NDArray[np.float32]:
        """(n, frames) of one output."""
        if name not in self.outputs:
            raise DatasetError(f"a data set of {self.specimen.name} has no output '{name}'; it has {self.outputs}")
        return self.values[..., self.outputs.index(name)]

    def joined(self, other: Dataset) -> Dataset:
        """Both data sets as one; DatasetError when they are not of one kind, or share samples."""
        return join(self, other)
