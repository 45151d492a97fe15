"""What boxes have in common: a law, what is drawn of its tests, when they are looked at, and what is kept of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from creepkit.arrays import Floats
from creepkit.dataset.criteria import Criterion
from creepkit.dataset.design import Draws
from creepkit.dataset.ranges import ConditionRanges, condition_range
from creepkit.dataset.reference import ReferenceStress
from creepkit.dataset.time_grid import PAPER_END, TimeGrid
from creepkit.language import CreepLaw
from creepkit.language.tree import law_to_json


@dataclass(frozen=True)
class SamplingDomain:
    """A design that draws a law's parameters and the conditions of its tests from ranges.

    reference : what stands for a test where the rate of its material is wanted, and which rates are useful.
    """

    law: CreepLaw
    conditions: ConditionRanges
    grid: TimeGrid
    criteria: tuple[Criterion, ...]
    reference_stress: ReferenceStress

    name: ClassVar[str]
    """The word for it; part of its document."""

    @property
    def condition_names(self) -> tuple[str, ...]:
        """What is drawn of a test."""
        return self.conditions.names

    @property
    def specimen(self) -> str:
        """The kind of test."""
        return self.conditions.kind

    def draw(self, first: int, count: int, seed: int) -> Draws:
        """Return rows first to first + count of the sequence of a seed."""
        raise NotImplementedError

    def document(self) -> dict[str, Any]:
        """Everything that decides the draws, as JSON-able data; boxes add what is theirs."""
        return {
            "box": self.name,
            "version": 1,
            "law": law_to_json(self.law),
            "conditions": self.conditions.document(),
            "grid": self.grid.document(),
            "criteria": [{"criterion": type(c).__name__, **vars(c)} for c in self.criteria],
        }


def uniform_in_bounds(law: CreepLaw, unit_coordinates: Floats) -> Floats:
    """Internal parameters at coordinates (rows, parameters) from 0 to 1, each uniform on its own scale."""
    low, high = np.array([[p.to_internal(b) for b in p.bounds] for p in law.params.values()]).reshape(-1, 2).T
    return np.asarray(low + unit_coordinates * (high - low))


def default_grid(interval: float, ranges: Mapping[str, Any]) -> TimeGrid:
    """Frames up to the end of the longest test."""
    return TimeGrid.every(interval, condition_range("end_time", ranges.get("end_time", PAPER_END)).high)
