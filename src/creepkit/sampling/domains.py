"""Sampling domains: what is drawn of the parameters of a law and of its tests, and the share of draws that is accepted.

The paper domain is uniform in the bounds of the law (Materials and Methods and Table 1 of the paper). The conditioned
domain is uniform in the logarithm of the mean rate at the reference stress, so that most samples creep visibly and
survive the test.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.errors import DatasetError, nearest
from creepkit.files.record_codec import RecordCodec, ValueCodec
from creepkit.language import CreepLaw, temperature
from creepkit.language.law_codec import law_from_json, law_to_json
from creepkit.presentation import Presentable
from creepkit.records import Specimen
from creepkit.sampling.coefficients import (
    draw_stress_scales,
    solve_coefficients,
    solve_damage_coefficients,
    stress_scale_positions,
    term_groups,
)
from creepkit.sampling.conditions import (
    END,
    PAPER_END,
    PAPER_INTERVAL,
    ConditionRanges,
    TimeGrid,
    condition_range,
    condition_ranges,
    specimen_conditions,
)
from creepkit.sampling.criteria import Criterion, DrawCriterion, conditioned_criteria, paper_criteria
from creepkit.sampling.rates import (
    SELECTION_DIMENSIONS,
    Draws,
    RateEvaluationPoints,
    ReferenceStress,
    active_terms,
    additive_recurrence_step,
    author_parameters,
    ln_term_fractions,
    mean_ln_rate,
    reference_stress_of,
    sobol_rows,
)

CODEC = RecordCodec(
    values={CreepLaw: ValueCodec(law_to_json, law_from_json)},
    omitted={ReferenceStress: ("specimen",)},  # which a data set states itself
)
"""Of designs."""


@dataclass(frozen=True)
class SamplingDomain:
    """A design that draws a law's parameters and the conditions of its tests from ranges.

    reference_stress : the stress that represents a test, and which rates are useful there.
    screened : leave out simulations that the specimen's reduced-order model rejects; see dataset.simulation.
    """

    law: CreepLaw
    conditions: ConditionRanges
    grid: TimeGrid
    criteria: tuple[Criterion, ...]
    reference_stress: ReferenceStress
    screened: bool = field(default=False, kw_only=True)

    name: ClassVar[str]
    """The word for it."""

    @property
    def condition_names(self) -> tuple[str, ...]:
        """Names of the conditions that are drawn."""
        return self.conditions.names

    @property
    def specimen(self) -> str:
        """The kind of test."""
        return self.conditions.kind

    def draw(self, first: int, count: int, seed: int) -> Draws:
        """Return rows first to first + count of the sequence of a seed."""
        raise NotImplementedError

    def document(self) -> dict[str, Any]:
        """Everything that decides the draws, as JSON-able data."""
        return {"domain": self.name, **CODEC.to_json(self)}


def uniform_in_bounds(law: CreepLaw, unit_coordinates: Floats) -> Floats:
    """Internal values, (rows, parameters), each uniform on its own scale.

    unit_coordinates : (rows, parameters) from 0 to 1.
    """
    low, high = law.internal_bounds
    return np.asarray(low + unit_coordinates * (high - low))


def default_grid(interval: float, specimen: Specimen, ranges: Mapping[str, Any]) -> TimeGrid:
    """Frames up to the end of the longest test."""
    stated = {**dict(specimen_conditions(specimen).defaults), **ranges}
    return TimeGrid.every(interval, condition_range(END, stated.get(END, PAPER_END), "s").high)


@dataclass(frozen=True)
class PaperDomain(SamplingDomain):
    """Uniform in the bounds of a law and the ranges of conditions: the paper's, with a second load level not below the
    first, and a jump at 2 to 10 h of 12 h.
    """

    name: ClassVar[str] = "paper"
    screened: bool = field(default=True, kw_only=True)

    def draw(self, first: int, count: int, seed: int) -> Draws:
        """Return rows of the sequence: parameters first, then conditions."""
        parameter_count = len(self.law.params)
        unit_coordinates = sobol_rows(parameter_count + len(self.condition_names), first, count, seed)
        parameters = author_parameters(self.law, uniform_in_bounds(self.law, unit_coordinates[:, :parameter_count]))
        return Draws(parameters, self.conditions.draw(unit_coordinates[:, parameter_count:]), self.condition_names)


MOST_TRIALS = 32
"""Points at which parameters within the bounds are sought for a row."""


@dataclass(frozen=True)
class ConditionedDomain(SamplingDomain):
    """Uniform in the log of the mean rate at the reference stress."""

    name: ClassVar[str] = "conditioned"

    def draw(self, first: int, count: int, seed: int) -> Draws:
        """Return rows of the sequence: total rate, choice of groups, their fractions, parameters, then conditions."""
        group_count = len(term_groups(self.law))
        sizes = (1, SELECTION_DIMENSIONS, group_count, len(self.law.params), len(self.condition_names))
        unit_coordinates = np.split(sobol_rows(sum(sizes), first, count, seed), np.cumsum(sizes)[:-1], axis=1)
        tests = Draws(np.zeros((count, 0)), self.conditions.draw(unit_coordinates[4]), self.condition_names)
        low, high = self.reference_stress.useful_rates(tests, self.conditions.end)
        active = active_terms(unit_coordinates[1], group_count)
        ln_rates = np.log(10.0) * (low + unit_coordinates[0][:, 0] * (high - low))[:, None] + ln_term_fractions(
            unit_coordinates[2], active
        )
        points = self.reference_stress.evaluation_points(tests, self.conditions.end)
        return Draws(
            self._parameters(unit_coordinates[3], ln_rates, points, tests), tests.conditions, self.condition_names
        )

    def _parameters(
        self, unit_coordinates: Floats, ln_rates: Floats, points: RateEvaluationPoints, tests: Draws
    ) -> Floats:
        """The author's parameters for wanted rates.

        A row whose parameters leave the bounds or break the law's constraints moves on, by a fixed step in all
        coordinates at once, to the first place where they do not.
        """
        parameters = self._solved_parameters(unit_coordinates, ln_rates, points)
        rows, step = np.arange(len(unit_coordinates)), additive_recurrence_step(unit_coordinates.shape[1])
        criteria = [c for c in self.criteria if isinstance(c, DrawCriterion)]
        for trial in range(1, MOST_TRIALS):
            draws = Draws(parameters[rows], tests.conditions[rows], self.condition_names)
            rows = rows[~np.all([c.passes(self.law, draws) for c in criteria], axis=0)]
            if not rows.size:
                break
            shifted = (unit_coordinates[rows] + trial * step) % 1.0
            parameters[rows] = self._solved_parameters(shifted, ln_rates[rows], points.rows(rows))
        return parameters

    def _solved_parameters(self, unit_coordinates: Floats, ln_rates: Floats, points: RateEvaluationPoints) -> Floats:
        groups = term_groups(self.law)
        theta = uniform_in_bounds(self.law, unit_coordinates)
        theta = draw_stress_scales(
            self.law, groups, theta, unit_coordinates[:, list(stress_scale_positions(self.law))], ln_rates, points
        )
        theta = solve_coefficients(groups, theta, ln_rates, points)
        return author_parameters(self.law, solve_damage_coefficients(self.law, theta, unit_coordinates, points))


DEFAULT_DRAWS = 4096
"""Rows drawn."""


@dataclass(frozen=True, eq=False)
class Acceptance(Presentable, text="reports.dataset:acceptance_text"):
    """What is known of a design without simulating it.

    draws : rows of the design. criteria_met : {criterion before simulation: (rows,) whether it is met on its own}.
    log10_strains : (rows,) log10 of the mean rate at the reference stress times the duration of the test.
    useful_strains : (rows, 2) log10 of the strains between which creep is visible and the test lasts, as a rule.
    """

    design: SamplingDomain
    seed: int
    draws: Draws
    criteria_met: Mapping[str, Bools]
    log10_strains: Floats
    useful_strains: Floats

    @property
    def kept(self) -> Bools:
        """Which rows meet every criterion that needs no simulation, (rows,)."""
        return np.asarray(np.all([np.ones(len(self.draws), bool), *self.criteria_met.values()], axis=0))

    @property
    def useful(self) -> Bools:
        """Which of them have a useful rate, (rows,); of the others some may be useful, too.

        Of Eq. (2) in the paper's sampling domain 8 % have, and 16 % of 600 simulated draws crept visibly and lasted:
        the paper's test piece relieves itself of stress as it deflects, and so outlasts rates above the window.
        """
        in_range = (self.log10_strains >= self.useful_strains[:, 0]) & (self.log10_strains <= self.useful_strains[:, 1])
        return np.asarray(self.kept & in_range)


def acceptance(design: SamplingDomain, draws: int = DEFAULT_DRAWS, seed: int = 0) -> Acceptance:
    """Return what a design's criteria reject before simulation, and how its rates lie; nothing is simulated.

    draws : number of rows; a rejection counts for the first criterion that is not met.
    """
    rows = design.draw(0, draws, seed)
    criteria_met = {c.name: c.passes(design.law, rows) for c in design.criteria if isinstance(c, DrawCriterion)}
    end, reference = design.conditions.end, design.reference_stress
    points = reference.evaluation_points(rows, end)
    log10_rates = mean_ln_rate(design.law, design.law.to_internal(rows.parameters), points) / np.log(10.0)
    log10_end_times = np.log10(rows.condition("end_time", end))
    useful_rates = np.stack(np.broadcast_arrays(*reference.useful_rates(rows, end)), axis=1)
    return Acceptance(
        design, seed, rows, criteria_met, log10_rates + log10_end_times, useful_rates + log10_end_times[:, None]
    )


def sampling_design(
    law: CreepLaw,
    specimen: Specimen,
    domain: str = "conditioned",
    *,
    every: float = PAPER_INTERVAL,
    grid: TimeGrid | None = None,
    **ranges: Any,
) -> SamplingDomain:
    """Return a design for a law and a specimen; see PaperDomain and ConditionedDomain.

    domain : "conditioned", whose samples creep visibly, for laws whose terms have rate coefficients (else
        DatasetError), or "paper", uniform in the law's bounds.
    every : s between frames. grid : in its place, other times.
    ranges : of conditions, (low, high) or a number, by the names of the specimen's data sets or the general ones:
        force_1=(5, 20), span=(40, 60), end_time=3600, or force=(5, 20) of both levels of the load.
    """
    if domain not in ("conditioned", "paper"):
        raise DatasetError(f"there is no sampling domain '{domain}': {nearest(domain, ('conditioned', 'paper'))}")
    if domain == "conditioned":
        term_groups(law)
    grid = grid or default_grid(every, specimen, ranges)
    conditions = condition_ranges(specimen, grid, ranges, needs_temperature=law.uses(temperature))
    reference = reference_stress_of(specimen)
    if domain == "paper":
        return PaperDomain(law, conditions, grid, paper_criteria(specimen), reference)
    return ConditionedDomain(law, conditions, grid, conditioned_criteria(law, specimen, conditions.end), reference)
