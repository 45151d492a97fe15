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
from creepkit.dataset.box import SamplingDomain, default_grid, uniform_in_bounds
from creepkit.dataset.coefficients import term_groups, solve_coefficients
from creepkit.dataset.conditions import test_kind
from creepkit.dataset.criteria_of_boxes import conditioned_criteria
from creepkit.dataset.design import Draws
from creepkit.dataset.growths import solve_damage_coefficients
from creepkit.dataset.looks import RateEvaluationPoints
from creepkit.dataset.ranges import PAPER_RANGES, condition_ranges
from creepkit.dataset.reference import reference_stress_of
from creepkit.dataset.shares import SELECTION_DIMENSIONS, TERM_COUNT_PROBABILITIES, ln_term_fractions, active_terms
from creepkit.dataset.sobol import sobol_rows, additive_recurrence_step
from creepkit.dataset.stress_scales import draw_stress_scales, stress_scale_positions
from creepkit.dataset.term_rates import author_parameters
from creepkit.dataset.time_grid import PAPER_INTERVAL, TimeGrid
from creepkit.language import CreepLaw, temperature
from creepkit.records import Specimen

MOST_TRIALS = 32
"""Places at which the parameters of a row are looked for."""


@dataclass(frozen=True)
class ConditionedDomain(SamplingDomain):
    """Uniform in the log of the mean rate at the reference stress; how_many : shares of rows with 1, 2, 3 parts."""

    term_count_probabilities: tuple[float, ...] = TERM_COUNT_PROBABILITIES

    name: ClassVar[str] = "conditioned"

    def draw(self, first: int, count: int, seed: int) -> Draws:
        """Return rows of the sequence: total rate, choice of parts, their shares, parameters, then conditions."""
        group_count = len(term_groups(self.law))
        sizes = (1, SELECTION_DIMENSIONS, group_count, len(self.law.params), len(self.condition_names))
        unit_coordinates = np.split(sobol_rows(sum(sizes), first, count, seed), np.cumsum(sizes)[:-1], axis=1)
        tests = Draws(np.zeros((count, 0)), self.conditions.draw(unit_coordinates[4]), self.condition_names)
        low, high = self.reference_stress.useful_rates(tests, self.conditions.end)
        active = active_terms(unit_coordinates[1], group_count, self.term_count_probabilities)
        ln_rates = np.log(10.0) * (low + unit_coordinates[0][:, 0] * (high - low))[:, None] + ln_term_fractions(unit_coordinates[2], active)
        points = self.reference_stress.evaluation_points(tests, self.conditions.end)
        return Draws(self._parameters(unit_coordinates[3], active, ln_rates, points, tests), tests.conditions, self.condition_names)

    def _parameters(self, unit_coordinates: Floats, active: Bools, ln_rates: Floats, points: RateEvaluationPoints, tests: Draws) -> Floats:
        """The author's parameters for wanted rates.

        A row whose parameters leave the bounds or break the law's constraints moves on, by a fixed step in all
        coordinates at once, to the first place where they do not.
        """
        parameters = self._solved_parameters(unit_coordinates, active, ln_rates, points)
        rejected_rows, step = np.arange(len(unit_coordinates)), additive_recurrence_step(unit_coordinates.shape[1])
        for trial in range(1, MOST_TRIALS):
            rejected_rows = rejected_rows[~self._meets_draw_criteria(Draws(parameters[rejected_rows], tests.conditions[rejected_rows], self.condition_names))]
            if not rejected_rows.size:
                break
            shifted = (unit_coordinates[rejected_rows] + trial * step) % 1.0
            parameters[rejected_rows] = self._solved_parameters(shifted, active[rejected_rows], ln_rates[rejected_rows], points.rows(rejected_rows))
        return parameters

    def _solved_parameters(self, unit_coordinates: Floats, active: Bools, ln_rates: Floats, points: RateEvaluationPoints) -> Floats:
        groups = term_groups(self.law)
        theta = self.shape_parameters(unit_coordinates, active, points)
        theta = draw_stress_scales(self.law, groups, theta, unit_coordinates[:, list(stress_scale_positions(self.law))], ln_rates, points)
        theta = solve_coefficients(groups, theta, ln_rates, points)
        return author_parameters(self.law, solve_damage_coefficients(self.law, theta, unit_coordinates, points))

    def _meets_draw_criteria(self, draws: Draws) -> Bools:
        met = [c.passes(self.law, draws) for c in self.criteria if c.stage == "before"]
        return np.asarray(np.all(met, axis=0))

    def shape_parameters(self, unit_coordinates: Floats, active: Bools, points: RateEvaluationPoints) -> Floats:
        """Internal parameters within their bounds, before coefficients and stress scales; there : which parts are."""
        return uniform_in_bounds(self.law, unit_coordinates)

    def document(self) -> dict[str, Any]:
        """Everything that decides the draws, as JSON-able data."""
        return {**super().document(), "reference": vars(self.reference_stress), "how_many": self.term_count_probabilities}


def conditioned_domain(
    law: CreepLaw, specimen: Specimen, *, every: float = PAPER_INTERVAL, grid: TimeGrid | None = None, **ranges: Any
) -> ConditionedDomain:
    """Return the conditioned box for any law whose terms have rate coefficients (else DatasetError).

    every : s between frames. grid : in its place, other times. given : other ranges of conditions, see design_of.
    """
    kind = test_kind(specimen)
    term_groups(law)
    grid = grid or default_grid(every, ranges)
    condition_space = condition_ranges(kind, grid, ranges, PAPER_RANGES[kind], needs_temperature=law.uses(temperature))
    reference = reference_stress_of(specimen)
    return ConditionedDomain(law, condition_space, grid, conditioned_criteria(law, kind, condition_space.end), reference)
