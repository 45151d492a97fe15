"""The paper's box: every parameter uniform in its bounds, every test as in the paper.

Materials and Methods, "Data generation and preparation", and Table 1: 13 inputs for Eq. (2), 11 for Eq. (1), of which
m is one. Log10 of parameters of log scale is uniform (A and B there). {0} of Table 1 has no volume: it is never drawn.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from creepkit.dataset.box import Box, grid_for, within_bounds
from creepkit.dataset.conditions import kind_of
from creepkit.dataset.criteria_of_boxes import paper_criteria
from creepkit.dataset.design import Draws
from creepkit.dataset.ranges import PAPER, conditions
from creepkit.dataset.reference import reference_of
from creepkit.dataset.sobol import sobol
from creepkit.dataset.term_rates import authors
from creepkit.dataset.time_grid import PAPER_INTERVAL, TimeGrid
from creepkit.language import CreepLaw, temperature
from creepkit.records import Specimen


@dataclass(frozen=True)
class PaperBox(Box):
    """Uniform in the bounds of a law and the ranges of conditions.

    screened : leave out simulations that are hopeless by the specimen's stand-in; see dataset.sketching.
    """

    screened: bool = True

    name: ClassVar[str] = "paper"

    def draw(self, first: int, count: int, seed: int) -> Draws:
        """Return rows of the sequence: parameters first, then conditions."""
        size = len(self.law.params)
        unit = sobol(size + len(self.condition_names), first, count, seed)
        parameters = authors(self.law, within_bounds(self.law, unit[:, :size]))
        return Draws(parameters, self.conditions.draw(unit[:, size:]), self.condition_names)

    def document(self) -> dict[str, Any]:
        """Everything that decides the draws, as JSON-able data."""
        return {**super().document(), "screened": self.screened}


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
