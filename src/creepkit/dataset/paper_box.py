"""The paper's box: every parameter uniform in its bounds, every test as in the paper.

Materials and Methods, "Data generation and preparation", and Table 1: 13 inputs for Eq. (2), 11 for Eq. (1), of which
m is one. Log10 of parameters of log scale is uniform (A and B there). {0} of Table 1 has no volume: it is never drawn.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from creepkit.dataset.box import SamplingDomain, default_grid, uniform_in_bounds
from creepkit.dataset.conditions import test_kind
from creepkit.dataset.criteria_of_boxes import paper_criteria
from creepkit.dataset.design import Draws
from creepkit.dataset.ranges import PAPER_RANGES, condition_ranges
from creepkit.dataset.reference import reference_stress_of
from creepkit.dataset.sobol import sobol_rows
from creepkit.dataset.term_rates import author_parameters
from creepkit.dataset.time_grid import PAPER_INTERVAL, TimeGrid
from creepkit.language import CreepLaw, temperature
from creepkit.records import Specimen


@dataclass(frozen=True)
class PaperDomain(SamplingDomain):
    """Uniform in the bounds of a law and the ranges of conditions.

    screened : leave out simulations that are hopeless by the specimen's stand-in; see dataset.sketching.
    """

    screened: bool = True

    name: ClassVar[str] = "paper"

    def draw(self, first: int, count: int, seed: int) -> Draws:
        """Return rows of the sequence: parameters first, then conditions."""
        parameter_count = len(self.law.params)
        unit_coordinates = sobol_rows(parameter_count + len(self.condition_names), first, count, seed)
        parameters = author_parameters(self.law, uniform_in_bounds(self.law, unit_coordinates[:, :parameter_count]))
        return Draws(parameters, self.conditions.draw(unit_coordinates[:, parameter_count:]), self.condition_names)

    def document(self) -> dict[str, Any]:
        """Everything that decides the draws, as JSON-able data."""
        return {**super().document(), "screened": self.screened}


def paper_domain(
    law: CreepLaw, specimen: Specimen, *, every: float = PAPER_INTERVAL, grid: TimeGrid | None = None,
    screened: bool = True, **ranges: Any,
) -> PaperDomain:  # fmt: skip
    """Return the paper's box of any law: its bounds, E 50 to 300 GPa, Tj 2 to 10 h of 12 h, P1 <= P2 from 3 to 25 MPa.

    every : s between frames. grid : in its place, other times. screened : see PaperBox. given : other ranges of
    conditions, see design_of.
    """
    kind = test_kind(specimen)
    grid = grid or default_grid(every, ranges)
    condition_space = condition_ranges(kind, grid, ranges, PAPER_RANGES[kind], needs_temperature=law.uses(temperature))
    return PaperDomain(law, condition_space, grid, paper_criteria(kind), reference_stress_of(specimen), screened)
