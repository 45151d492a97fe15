"""The conditioned box: samples of any law whose creep can be seen and whose tests last.

In the paper's box rates span fifty decades, of which three are useful, and nine useful samples in ten have one term
only. Here what is drawn is the mean rate over the test at its reference stress (see reference), which terms give it and
in which shares; from that follow the coefficients (see coefficients). Exponents are uniform in the law's bounds, stress
scales are drawn by their ratio (see stress_scales), damage by the share of life that a test takes (see growths).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.dataset.box import Box, grid_for, within_bounds
from creepkit.dataset.coefficients import parts_of, solve
from creepkit.dataset.conditions import kind_of
from creepkit.dataset.criteria_of_boxes import informative
from creepkit.dataset.design import Draws
from creepkit.dataset.growths import solve_growths
from creepkit.dataset.looks import Looks
from creepkit.dataset.ranges import PAPER, conditions
from creepkit.dataset.reference import reference_of
from creepkit.dataset.shares import DIMENSIONS, HOW_MANY, ln_shares, present
from creepkit.dataset.sobol import sobol, spread_step
from creepkit.dataset.stress_scales import draw_scales, scales_of
from creepkit.dataset.term_rates import authors
from creepkit.dataset.time_grid import PAPER_INTERVAL, TimeGrid
from creepkit.language import CreepLaw, temperature
from creepkit.records import Specimen

TURNS = 32
"""Places at which the parameters of a row are looked for."""


@dataclass(frozen=True)
class ConditionedBox(Box):
    """Uniform in the log of the mean rate at the reference stress; how_many : shares of rows with 1, 2, 3 parts."""

    how_many: tuple[float, ...] = HOW_MANY

    name: ClassVar[str] = "conditioned"

    def draw(self, first: int, count: int, seed: int) -> Draws:
        """Return rows of the sequence: total rate, choice of parts, their shares, parameters, then conditions."""
        parts = len(parts_of(self.law))
        sizes = (1, DIMENSIONS, parts, len(self.law.params), len(self.condition_names))
        unit = np.split(sobol(sum(sizes), first, count, seed), np.cumsum(sizes)[:-1], axis=1)
        tests = Draws(np.zeros((count, 0)), self.conditions.draw(unit[4]), self.condition_names)
        low, high = self.reference.window(tests, self.conditions.end)
        there = present(unit[1], parts, self.how_many)
        rates = np.log(10.0) * (low + unit[0][:, 0] * (high - low))[:, None] + ln_shares(unit[2], there)
        looks = self.reference.looks(tests, self.conditions.end)
        return Draws(self._parameters(unit[3], there, rates, looks, tests), tests.conditions, self.condition_names)

    def _parameters(self, unit: Floats, there: Bools, rates: Floats, looks: Looks, tests: Draws) -> Floats:
        """The author's parameters for wanted rates.

        A row whose parameters leave the bounds or break the law's constraints moves on, by a fixed step in all
        coordinates at once, to the first place where they do not.
        """
        found = self._solved(unit, there, rates, looks)
        left, step = np.arange(len(unit)), spread_step(unit.shape[1])
        for turn in range(1, TURNS):
            left = left[~self._sound(Draws(found[left], tests.conditions[left], self.condition_names))]
            if not left.size:
                break
            moved = (unit[left] + turn * step) % 1.0
            found[left] = self._solved(moved, there[left], rates[left], looks.rows(left))
        return found

    def _solved(self, unit: Floats, there: Bools, rates: Floats, looks: Looks) -> Floats:
        parts = parts_of(self.law)
        theta = self.exponents(unit, there, looks)
        theta = draw_scales(self.law, parts, theta, unit[:, list(scales_of(self.law))], rates, looks)
        theta = solve(parts, theta, rates, looks)
        return authors(self.law, solve_growths(self.law, theta, unit, looks))

    def _sound(self, draws: Draws) -> Bools:
        met = [c.passes(self.law, draws) for c in self.criteria if c.stage == "before"]
        return np.asarray(np.all(met, axis=0))

    def exponents(self, unit: Floats, there: Bools, looks: Looks) -> Floats:
        """Internal parameters within their bounds, before coefficients and stress scales; there : which parts are."""
        return within_bounds(self.law, unit)

    def document(self) -> dict[str, Any]:
        """Everything that decides the draws, as JSON-able data."""
        return {**super().document(), "reference": vars(self.reference), "how_many": self.how_many}


def conditioned_box(
    law: CreepLaw, specimen: Specimen, *, every: float = PAPER_INTERVAL, grid: TimeGrid | None = None, **given: Any
) -> ConditionedBox:
    """Return the conditioned box for any law whose terms have rate coefficients (else DatasetError).

    every : s between frames. grid : in its place, other times. given : other ranges of conditions, see design_of.
    """
    kind = kind_of(specimen)
    parts_of(law)
    grid = grid or grid_for(every, given)
    space = conditions(kind, grid, given, PAPER[kind], warm=law.uses(temperature))
    reference = reference_of(specimen)
    return ConditionedBox(law, space, grid, informative(law, kind, space.end), reference)
