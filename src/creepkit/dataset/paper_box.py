"""The paper's box: every parameter uniform in its bounds, every test as in the paper.

Materials and Methods, "Data generation and preparation", and Table 1: 13 inputs for Eq. (2), 11 for Eq. (1), of which
m is one. Log10 of parameters of log scale is uniform (A and B there). {0} of Table 1 has no volume: it is never drawn.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.dataset.conditions import kind_of
from creepkit.dataset.criteria import Criterion
from creepkit.dataset.criteria_of_boxes import paper_criteria
from creepkit.dataset.design import Design, Draws
from creepkit.dataset.ranges import PAPER, Conditions, conditions, range_of
from creepkit.dataset.reference import Reference, reference_of
from creepkit.dataset.sobol import sobol
from creepkit.dataset.term_rates import authors
from creepkit.dataset.time_grid import PAPER_END, PAPER_INTERVAL, TimeGrid
from creepkit.language import CreepLaw, temperature
from creepkit.language.tree import law_to_json
from creepkit.records import Specimen


@dataclass(frozen=True)
class PaperBox:
    """Uniform in the bounds of a law and the ranges of conditions.

    screened : leave out simulations that are hopeless by the specimen's stand-in; see dataset.sketching.
    """

    law: CreepLaw
    conditions: Conditions
    grid: TimeGrid
    criteria: tuple[Criterion, ...]
    reference: Reference
    screened: bool = True
    name: str = field(default="paper", init=False)

    @property
    def condition_names(self) -> tuple[str, ...]:
        """What is drawn of a test."""
        return self.conditions.names

    @property
    def specimen(self) -> str:
        """The kind of test."""
        return self.conditions.kind

    def draw(self, first: int, count: int, seed: int) -> Draws:
        """Return rows of the sequence: parameters first, then conditions."""
        size = len(self.law.params)
        unit = sobol(size + len(self.condition_names), first, count, seed)
        parameters = authors(self.law, within_bounds(self.law, unit[:, :size]))
        return Draws(parameters, self.conditions.draw(unit[:, size:]), self.condition_names)

    def document(self) -> dict[str, Any]:
        """Everything that decides the draws, as JSON-able data."""
        return {**document(self, self.conditions), "screened": self.screened}


def paper_box(
    law: CreepLaw, specimen: Specimen, *, every: float = PAPER_INTERVAL, grid: TimeGrid | None = None,
    screened: bool = True, **given: Any,
) -> PaperBox:  # fmt: skip
    """Return the paper's box of any law: its bounds, E 50 to 300 GPa, Tj 2 to 10 h of 12 h, P1 <= P2 from 3 to 25 MPa.

    every : s between frames. grid : in its place, other times. screened : see PaperBox. given : other ranges of
    conditions, see design_of.
    """
    kind = kind_of(specimen)
    grid = grid or grid_for(every, given)
    space = conditions(kind, grid, given, PAPER[kind], warm=law.uses(temperature))
    return PaperBox(law, space, grid, paper_criteria(kind), reference_of(specimen), screened)


def within_bounds(law: CreepLaw, unit: Floats) -> Floats:
    """Internal parameters at coordinates (rows, parameters) from 0 to 1, each uniform on its own scale."""
    low, high = np.array([[p.to_internal(b) for b in p.bounds] for p in law.params.values()]).reshape(-1, 2).T
    return np.asarray(low + unit * (high - low))


def grid_for(every: float, given: Mapping[str, Any]) -> TimeGrid:
    """Frames up to the end of the longest test."""
    return TimeGrid.every(every, range_of("end_time", given.get("end_time", PAPER_END)).high)


def document(design: Design, conditions: Conditions) -> dict[str, Any]:
    """What every box says of itself."""
    return {
        "box": design.name,
        "version": 1,
        "law": law_to_json(design.law),
        "conditions": conditions.document(),
        "grid": design.grid.document(),
        "criteria": [{"criterion": type(c).__name__, **vars(c)} for c in design.criteria],
    }
