"""Sampling domains: what is drawn of the parameters of a law and of its tests, and the share of draws that is accepted.

The paper domain is uniform in the bounds of the law (Materials and Methods and Table 1 of the paper). The conditioned
domain is uniform in the logarithm of the mean rate at the reference stress, so that most samples creep visibly and
survive the test.

Acceptance criteria of samples apply before simulation (rates, bounds, constraints of the law) and after it. Criteria 1
to 5 are those of the paper (Materials and Methods, "Data generation and preparation"). Criterion 4 of the paper asks
for a displacement above 0.01 mm, meant to remove samples without creep. The elastic deflection alone is 0.01 to 0.2 mm,
so criterion 4 is applied here to the growth of the output by creep within each of the two holds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
import sympy

from creepkit.arrays import Bools, Floats
from creepkit.errors import DatasetError, nearest
from creepkit.files.record_codec import RecordCodec, ValueCodec
from creepkit.kernels import tension_point
from creepkit.language import CreepLaw, temperature
from creepkit.language.law_codec import law_from_json, law_to_json
from creepkit.language.symbols import POINT_VARIABLES
from creepkit.records import ROOM_TEMPERATURE, Specimen, Status
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
    creep_output,
    specimen_conditions,
)
from creepkit.sampling.rates import (
    SELECTION_DIMENSIONS,
    Draws,
    RateArguments,
    RateEvaluationPoints,
    ReferenceStress,
    active_terms,
    additive_recurrence_step,
    author_parameters,
    ln_term_fractions,
    log10_rate,
    reference_stress_of,
    sobol_rows,
)

TIME_FRACTIONS = np.concatenate([np.zeros(1), np.geomspace(1e-3, 1.0, 60)])
"""Times at which the constraints of a law are evaluated, as fractions of the end of a test."""


CONSTRAINT_STRESS, CONSTRAINT_STRAIN = 100.0, 0.01
"""MPa and strain at which constraints are evaluated that depend on these."""


@lru_cache(maxsize=64)
def constraint_functions(law: CreepLaw) -> tuple[Callable[..., Any], ...]:
    """Each constraint of a law as a function of the point, internal variables and parameters; that it flows is one."""
    arguments = (*POINT_VARIABLES, *law.states, *law.params)
    flowing = [law.effective_stress > 0] if law.back_stresses else []
    relations = (*law.constraints, *flowing)
    return tuple(sympy.lambdify(arguments, relation, "numpy", dummify=True) for relation in relations)


def constraints_hold(law: CreepLaw, draws: Draws, end_times: Floats) -> Bools:
    """Which draws meet every constraint at every time of their tests, (rows,); what is not a number does not.

    end_times : (rows,) s.
    """
    parameters = [column[:, None] for column in draws.parameters.T]
    stress, strain = np.full((len(draws), TIME_FRACTIONS.size), CONSTRAINT_STRESS), CONSTRAINT_STRAIN
    temperature = draws.condition("temperature", ROOM_TEMPERATURE)[:, None]
    point = tension_point(law, stress, strain, TIME_FRACTIONS * end_times[:, None], temperature)
    holds = np.ones(len(draws), bool)
    for function in constraint_functions(law):
        with np.errstate(all="ignore"):
            satisfied = np.broadcast_to(function(*point, *parameters), stress.shape)
        holds &= satisfied.all(axis=1)
    return holds


@dataclass(frozen=True, eq=False)
class SimulationOutcome:
    """One simulated sample.

    times : (frames,) s. outputs : (frames, outputs) in their units; NaN after the end.
    hold_outputs : (4, outputs) at the end of the first ramp, just before the jump, at the end of the second ramp and
        at the end of the test; NaN where the simulation ended before. end_time : s, up to which it went.
    column : of the output that shows creep. falls : whether creep makes it smaller.
    """

    times: Floats
    outputs: Floats
    hold_outputs: Floats
    status: Status
    end_time: float
    conditions: Mapping[str, float]
    column: int = 0
    falls: bool = False

    @property
    def last_output(self) -> float:
        """The output that shows creep in the last frame that has one; NaN without any."""
        values = self.outputs[:, self.column]
        finite = values[np.isfinite(values)]
        return float(finite[-1]) if finite.size else float("nan")

    @property
    def creep_in_holds(self) -> tuple[float, float]:
        """Growth of the output that shows creep in each hold, or its fall; elastic jumps are left out.

        Of a hold that a burst cut short up to the last frame; NaN of one that never began.
        """
        start, before, after, end = self.hold_outputs[:, self.column]
        sign = -1.0 if self.falls else 1.0
        first_hold = (self.last_output if np.isnan(before) else before) - start
        return sign * float(first_hold), sign * float((self.last_output if np.isnan(end) else end) - after)


@dataclass(frozen=True)
class Criterion:
    """What criteria have in common: a name, and in words what is asked for."""

    name: str
    text: str


class DrawCriterion(Criterion):
    """What is asked of a draw before it is simulated."""

    def passes(self, law: CreepLaw, draws: Draws) -> Bools:
        """Which draws meet it, (rows,)."""
        raise NotImplementedError


class OutcomeCriterion(Criterion):
    """What is asked of a simulated sample."""

    def passes(self, outcome: SimulationOutcome) -> bool:
        """Whether the outcome meets it."""
        raise NotImplementedError


@dataclass(frozen=True)
class RateLimit(DrawCriterion):
    """The law's rate at one point lies within limits, None where there is none: criteria 1 and 2.

    stress : MPa. lower, upper : log10 of the rate in 1/s: as logarithms rates do not underflow. time : s.
    """

    stress: float
    lower: float | None = None
    upper: float | None = None
    strain: float = 0.01
    time: float = 1e4

    def passes(self, law: CreepLaw, draws: Draws) -> Bools:
        """Which draws meet it, (rows,)."""
        arguments = RateArguments(self.stress, self.strain, self.time, draws.condition("temperature", ROOM_TEMPERATURE))
        log10_rates = log10_rate(law, draws.parameters, arguments)
        low, high = (limit if limit is not None else log10_rates for limit in (self.lower, self.upper))
        return np.asarray((log10_rates >= low) & (log10_rates <= high))


@dataclass(frozen=True)
class WithinBounds(DrawCriterion):
    """Every parameter lies within the law's bounds, or is off."""

    def passes(self, law: CreepLaw, draws: Draws) -> Bools:
        """Which draws meet it, (rows,)."""
        low, high = np.array([param.bounds for param in law.params.values()]).reshape(-1, 2).T
        off_values = np.array([np.nan if param.off is None else param.off for param in law.params.values()])
        values, slack = draws.parameters, 1e-9 * np.abs([low, high])
        return np.asarray(
            (((values >= low - slack[0]) & (values <= high + slack[1])) | (values == off_values)).all(axis=1)
        )


@dataclass(frozen=True)
class ConstraintsHold(DrawCriterion):
    """The constraints that the law declares hold throughout the test; end : s, of tests whose end is not drawn."""

    end: float

    def passes(self, law: CreepLaw, draws: Draws) -> Bools:
        """Which draws meet it, (rows,)."""
        return constraints_hold(law, draws, draws.condition("end_time", self.end))


@dataclass(frozen=True)
class SurvivesTime(OutcomeCriterion):
    """The simulation converged and went on for `seconds`, or to the end of a shorter test: criterion 3.

    None stands for the whole test. A burst is no failure of the simulation: with a number of seconds, one after them
    is admitted.
    """

    seconds: float | None = None

    def passes(self, outcome: SimulationOutcome) -> bool:
        """Whether the outcome meets it."""
        if outcome.status == Status.COMPLETE:
            return True
        return self.seconds is not None and outcome.status == Status.RUPTURED and outcome.end_time >= self.seconds


@dataclass(frozen=True)
class CreepInEachHold(OutcomeCriterion):
    """Creep above `threshold` in either hold, elastic jumps left out: criterion 4.

    A hold that a burst cut short counts up to its last frame; a second hold that was never reached is no growth.
    """

    threshold: float

    def passes(self, outcome: SimulationOutcome) -> bool:
        """Whether the outcome meets it."""
        return all(growth > self.threshold for growth in outcome.creep_in_holds)


@dataclass(frozen=True)
class TotalCreepAbove(OutcomeCriterion):
    """Creep of `threshold` or more in both holds together, elastic jumps left out."""

    threshold: float

    def passes(self, outcome: SimulationOutcome) -> bool:
        """Whether the outcome meets it."""
        return float(np.nansum(outcome.creep_in_holds)) >= self.threshold


@dataclass(frozen=True)
class FinalOutputAbove(OutcomeCriterion):
    """The output that shows creep is above `threshold` at the end: criterion 5.

    After a burst, in the last frame before it.
    """

    threshold: float

    def passes(self, outcome: SimulationOutcome) -> bool:
        """Whether the outcome meets it."""
        return outcome.last_output > self.threshold


PAPER_SHARE_OF_VISIBLE = 0.5
"""Of the creep that is plainly visible, what criteria 4 and 5 ask for: 0.01 mm, twice the resolution of the paper's
cameras."""


def paper_criteria(specimen: Specimen) -> tuple[Criterion, ...]:
    """Criteria 1 to 5 of the paper; 4 and 5 concern the output that shows creep, and 5 only one that grows with it."""
    shown = creep_output(specimen)
    least = PAPER_SHARE_OF_VISIBLE * shown.visible
    final = FinalOutputAbove("5", f"{shown.output} of more than {shown.text(least)} at the end", least)
    return (
        RateLimit("1", "rate of 1e-20 1/s or more at 600 MPa, strain 0.01, 10,000 s", 600.0, lower=-20.0),
        RateLimit("2", "rate of 1 1/s or less at 50 MPa, strain 0.01, 10,000 s", 50.0, upper=0.0),
        SurvivesTime("3", "simulation converged and lasted 1 h", 3600.0),
        CreepInEachHold("4", f"creep of more than {shown.text(least)} in each hold", least),
        *(() if shown.falls else (final,)),
    )


def conditioned_criteria(law: CreepLaw, specimen: Specimen, end: float) -> tuple[Criterion, ...]:
    """Criteria of the conditioned domain: a law as its author means it, a full history, and visible creep.

    end : s, of tests whose end is not drawn.
    """
    label = ("constraints", "what the law declares of its parameters holds throughout the test")
    constraint_criteria = (ConstraintsHold(*label, end),) if law.constraints else ()
    shown = creep_output(specimen)
    return (
        WithinBounds("bounds", "every parameter lies within the law's bounds"),
        *constraint_criteria,
        SurvivesTime("full history", "simulation went on to the end of the test"),
        TotalCreepAbove("visible creep", f"creep of {shown.text(shown.visible)} or more", shown.visible),
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
    """

    law: CreepLaw
    conditions: ConditionRanges
    grid: TimeGrid
    criteria: tuple[Criterion, ...]
    reference_stress: ReferenceStress

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
    ranges : of conditions, (low, high) or a number, by the names of the specimen's data sets:
        force_1=(5, 20), span=(40, 60), end_time=3600, or force=(5, 20) of both levels of the load.
    """
    if domain not in ("conditioned", "paper"):
        raise DatasetError(f"there is no sampling domain '{domain}': {nearest(domain, ('conditioned', 'paper'))}")
    if lacking := [one.name for one in law.conditions]:
        raise DatasetError(f"law '{law.name}' needs numbers for {', '.join(lacking)}: law.at({lacking[0]}=0.05)")
    if domain == "conditioned":
        term_groups(law)
    grid = grid or default_grid(every, specimen, ranges)
    conditions = condition_ranges(specimen, grid, ranges, needs_temperature=law.uses(temperature))
    reference = reference_stress_of(specimen)
    if domain == "paper":
        return PaperDomain(law, conditions, grid, paper_criteria(specimen), reference)
    return ConditionedDomain(law, conditions, grid, conditioned_criteria(law, specimen, conditions.end), reference)
