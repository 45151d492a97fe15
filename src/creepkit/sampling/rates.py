"""Creep rates of many parameter rows at once, and the mean rate of a test at its reference stress.

Reference stresses, and the growth of the output for each unit of reference strain, are the specimen's: its
`load_scaling` for all rows at once, or its reference_stress(history) and growth_per_strain(history), test by test.

Rows are drawn from the scrambled Sobol sequence, and say which terms of a law they contain. They do not depend on the
block in which they are drawn. Sobol (1967), USSR Comput. Math. Math. Phys. 7, 86; Owen scrambling as in
scipy.stats.qmc.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from scipy.special import gammaincinv, logsumexp

from creepkit.arrays import ArrayLike, Bools, Floats, Ints, frozen, set_fields
from creepkit.errors import DatasetError, nearest
from creepkit.kernels import lower, tension_point
from creepkit.language import CreepLaw, time
from creepkit.records import ROOM_TEMPERATURE, History, Specimen
from creepkit.sampling.conditions import (
    END,
    TEMPERATURE,
    SpecimenConditions,
    TimeGrid,
    check_stated,
    creep_output,
    mean_reference_stress,
    planned_test,
    record_of,
    specimen_conditions,
    tested_piece,
)
from creepkit.specimens.load_scaling import LoadScaling

MOST_ROWS = 2**30
"""Rows of one sequence, which has 30 bits."""


def sobol_rows(dimensions: int, first: int, count: int, seed: int) -> Floats:
    """Return rows `first` to `first + count` of the sequence of `seed`, (count, dimensions), each from 0 to below 1."""
    from scipy.stats import qmc  # takes a second, which only those who draw should wait

    if count < 1 or first < 0:
        raise DatasetError(f"{count} samples from row {first} on were asked for; ask for at least one, from row 0 on")
    if first + count > MOST_ROWS:
        raise DatasetError(
            f"a Sobol sequence has {MOST_ROWS} rows, row {first + count - 1} was asked for; change the seed"
        )
    if seed < 0:
        raise DatasetError(f"seed {seed} is not a whole number from zero on")
    engine = qmc.Sobol(dimensions, scramble=True, seed=seed)
    start = engine.random(1)  # scipy warns of a first block that is no power of two
    if first:
        engine.fast_forward(first - 1)
        return np.asarray(engine.random(count))
    return np.vstack([start, engine.random(count - 1)]) if count > 1 else start


def additive_recurrence_step(dimensions: int) -> Floats:
    """The step of an additive recurrence that spreads evenly over the unit cube, (dimensions,).

    Powers of 1/x with x^(dimensions+1) = x + 1 (Roberts 2018, The Unreasonable Effectiveness of Quasirandom Sequences).
    """
    x = 2.0
    for _ in range(60):
        x = (1.0 + x) ** (1.0 / (dimensions + 1))
    return np.asarray(x ** -np.arange(1.0, dimensions + 1))


@dataclass(frozen=True, eq=False)
class Draws:
    """Rows of a design.

    parameters : (rows, parameters) in the author's units, columns as law.names; 0 of a coefficient is off.
    conditions : (rows, conditions) in MPa, s, mm and K, columns as condition_names.
    """

    parameters: Floats
    conditions: Floats
    condition_names: tuple[str, ...]

    def __post_init__(self) -> None:
        set_fields(self, parameters=frozen(self.parameters), conditions=frozen(self.conditions))

    def __len__(self) -> int:
        return len(self.parameters)

    def condition(self, name: str, default: float | None = None) -> Floats:
        """(rows,) in MPa, s, mm or K, one condition of every row; `default` where the design does not vary it."""
        if name in self.condition_names:
            return np.asarray(self.conditions[:, self.condition_names.index(name)])
        if default is None:
            raise DatasetError(f"these draws have no condition '{name}': {nearest(name, self.condition_names)}")
        return np.full(len(self), default)


CONCENTRATION = 0.7
"""Parameter of the Dirichlet distribution of rate fractions: below 1 one group tends to dominate."""


TERM_COUNT_PROBABILITIES = (0.6, 0.3, 0.1)
"""Fractions of samples with one, two and three groups of terms."""


SELECTION_DIMENSIONS = 2
"""Coordinates that the choice of groups takes; their fractions take one for each group."""


def active_terms(unit_coordinates: Floats, group_count: int) -> Bools:
    """Which groups of terms are active, (rows, groups): how many, then which of the ways to choose them.

    unit_coordinates : (rows, 2) from 0 to 1.
    """
    weights = np.array(TERM_COUNT_PROBABILITIES[:group_count]) / sum(TERM_COUNT_PROBABILITIES[:group_count])
    subsets = (members for k in range(1, len(weights) + 1) for members in combinations(range(group_count), k))
    masks = [np.eye(group_count, dtype=bool)[list(chosen)].any(axis=0) for chosen in subsets]
    sizes = np.array([mask.sum() for mask in masks])
    first = np.searchsorted(sizes, np.arange(1, len(weights) + 2))
    count = np.minimum(np.searchsorted(np.cumsum(weights), unit_coordinates[:, 0], side="right"), len(weights) - 1)
    start, stop = first[count], first[count + 1]
    chosen = start + np.minimum((unit_coordinates[:, 1] * (stop - start)).astype(int), stop - start - 1)
    return np.asarray(np.array(masks)[chosen])


def ln_term_fractions(unit_coordinates: Floats, active: Bools) -> Floats:
    """ln of the fraction of the rate of each group, (rows, groups), -inf where it is off; Dirichlet by gamma quantiles.

    unit_coordinates : (rows, groups) from 0 to 1. active : (rows, groups).
    """
    sizes = np.where(active, gammaincinv(CONCENTRATION, np.clip(unit_coordinates, 1e-9, 1 - 1e-9)), 0.0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(sizes / sizes.sum(axis=1, keepdims=True)))


@dataclass(frozen=True, eq=False)
class RateArguments:
    """Where rates are evaluated.

    stress : number or (rows, ...) MPa; strain, time, temperature : number or (rows, ...) -, s, K.
    """

    stress: ArrayLike
    strain: ArrayLike
    time: ArrayLike
    temperature: ArrayLike


def log10_rate(law: CreepLaw, parameters: Floats, arguments: RateArguments) -> Floats:
    """Return log10 of the rate in 1/s, (rows,).

    parameters : (rows, parameters) in the author's units.
    """
    return np.asarray(ln_rate(law, law.to_internal(parameters), arguments) / np.log(10.0))


def ln_rate(
    law: CreepLaw, theta: Floats, arguments: RateArguments, states: Sequence[ArrayLike] | None = None
) -> Floats:
    """Return ln of the rate in 1/s, (rows, ...), in simple tension.

    theta : (rows, ..., parameters) internal values. states : internal variables, each (rows, ...), by default their
        initial values.
    """
    stress = np.asarray(arguments.stress, float)
    point = tension_point(law, stress, arguments.strain, arguments.time, arguments.temperature)
    variables = point if states is None else (*point[: len(point) - len(states)], *states)
    shape = np.broadcast_shapes(theta.shape[:-1], *(np.shape(v) for v in variables))
    columns = [np.broadcast_to(np.asarray(v, float), shape) for v in (*variables, *np.moveaxis(theta, -1, 0))]
    return np.asarray(lower(law, "numpy").internal_log_rate(*columns), float)


def author_parameters(law: CreepLaw, theta: Floats) -> Floats:
    """The author's values, (rows, parameters) in the law's order, of internal ones, theta (rows, parameters)."""
    return np.stack(list(law.from_internal(theta).values()), axis=-1)


POINT_COUNT = 12


POINT_FRACTIONS = (np.arange(POINT_COUNT) + 0.5) / POINT_COUNT
"""Times of the points as fractions of the end of the test."""


REFERENCE_STRAIN = 0.01
"""At which rates are stated, as in the paper's criteria 1 and 2."""


@dataclass(frozen=True, eq=False)
class RateEvaluationPoints:
    """Points in time at which the rates of tests are evaluated.

    stress : (rows, points) MPa, or (rows, 1) where it stays. times : (rows, points) s. temperature : (rows,) K.
    """

    stress: Floats
    times: Floats
    temperature: Floats

    def arguments(self, axes: int = 0, *, one_time: bool = False, factor: float = 1.0) -> RateArguments:
        """The points with `axes` more axes between rows and points.

        one_time : one point will do where the stress stays. factor : multiplies the stresses.
        """
        times = self.times[:, :1] if one_time else self.times
        columns = (factor * self.stress, times, self.temperature[:, None])
        stress, seconds, temperature = (v.reshape(v.shape[0], *[1] * axes, v.shape[1]) for v in columns)
        return RateArguments(stress, REFERENCE_STRAIN, seconds, temperature)

    def rows(self, rows: Ints) -> RateEvaluationPoints:
        """Some of the rows; rows : (k,) their numbers."""
        return RateEvaluationPoints(self.stress[rows], self.times[rows], self.temperature[rows])

    @property
    def end_times(self) -> Floats:
        """(rows,) s, when the tests end."""
        return np.asarray(self.times[:, -1] / POINT_FRACTIONS[-1])

    def midpoint_arguments(self, axes: int = 0) -> RateArguments:
        """The point at the mean stress and half the duration, with `axes` axes after the rows."""
        shape = (len(self.times), *[1] * axes)
        stress, seconds, temperature = (
            v.reshape(shape) for v in (self.mean_stress, 0.5 * self.end_times, self.temperature)
        )
        return RateArguments(stress, REFERENCE_STRAIN, seconds, temperature)

    @property
    def mean_stress(self) -> Floats:
        """(rows,) MPa, geometric mean of the stresses."""
        return np.asarray(np.exp(np.log(self.stress).mean(axis=1)))


def mean_ln_rate(law: CreepLaw, theta: Floats, points: RateEvaluationPoints, stress_factor: float = 1.0) -> Floats:
    """ln of the mean rate over a test, (rows, ...), the rate in 1/s.

    theta : (rows, ..., parameters) internal values. stress_factor : multiplies the stresses.
    """
    arguments = points.arguments(theta.ndim - 2, one_time=not law.uses(time), factor=stress_factor)
    ln_rates = ln_rate(law, theta[..., None, :], arguments)
    return np.asarray(logsumexp(ln_rates, axis=-1) - np.log(ln_rates.shape[-1]))


LARGEST_REFERENCE_STRAIN = 0.2
"""Largest reference strain at the end of a test; the test piece of the paper is then some 2 mm deep."""


@dataclass(frozen=True)
class ReferenceStress:
    """How loads become stresses and rates.

    specimen : whose tests they are. known : their conditions. visible_creep : of the output that shows creep, in its
        unit, that every sample should show. scaling : of all rows at once, None where the specimen is asked test by
        test.
    """

    specimen: Specimen
    known: SpecimenConditions
    visible_creep: float
    scaling: LoadScaling | None = None

    def evaluation_points(self, draws: Draws, end: float) -> RateEvaluationPoints:
        """Stresses and times of each row of draws; end : s, where it is not drawn."""
        first, second = (draws.condition(name)[:, None] for name in self.known.levels)
        times = POINT_FRACTIONS * draws.condition(END, end)[:, None]
        before_jump = times < draws.condition(self.known.jump)[:, None]
        if self.scaling is not None:
            stress = self.scaling.stresses(first, second, self._lengths(draws, self.scaling), before_jump)
        else:
            levels = (self._of_tests(mean_reference_stress, "reference_stress", draws, k, end) for k in (0, 1))
            stress = np.where(before_jump, *(stresses[:, None] for stresses in levels))
        return RateEvaluationPoints(stress, times, draws.condition(TEMPERATURE, ROOM_TEMPERATURE))

    def useful_rates(self, draws: Draws, end: float) -> tuple[Floats, Floats]:
        """log10 of the lowest and highest useful mean rate in 1/s, (rows,) each: half the visible creep, most strain.

        Half, because the higher of both load levels gives more creep than their geometric mean.
        """
        least_strain = 0.5 * self.visible_creep / self._growth(draws, end)
        end_times = draws.condition(END, end)
        return np.log10(least_strain / end_times), np.log10(LARGEST_REFERENCE_STRAIN / end_times)

    def _lengths(self, draws: Draws, scaling: LoadScaling) -> Floats:
        return draws.condition(scaling.length, scaling.nominal) if scaling.length else np.ones(len(draws))

    # ---- test by test ------------------------------------------------------------------------------------------------

    def _growth(self, draws: Draws, end: float) -> Floats:
        if self.scaling is not None:
            return self.scaling.growth(self._lengths(draws, self.scaling))
        return self._of_tests(lambda p, test: np.mean(p.growth_per_strain(test)), "growth_per_strain", draws, 0, end)

    def _of_tests(
        self, function: Callable[[Any, History], Any], method: str, draws: Draws, level: int, end: float
    ) -> Floats:
        """(rows,) what a method of the specimen says of the test of each row, with one of both levels held."""
        grid, values = TimeGrid(np.array([0.0, 1.0]), relative=True), []
        for row in draws.conditions.tolist():
            conditions = dict(zip(draws.condition_names, row, strict=True))
            held = {self.known.levels[0]: conditions[self.known.levels[level]], END: conditions.get(END, end)}
            others = {n: v for n, v in conditions.items() if n not in (*self.known.levels, self.known.jump)}
            test = planned_test(self.specimen, {**others, **held}, grid)
            values.append(float(function(*tested_piece(self.specimen, test, {}))))
            if not 0.0 < values[-1] < np.inf:
                raise DatasetError(
                    f"specimen '{self.known.kind}': its {method}(history) gives {values[-1]:g} for a planned test; it "
                    "must give a finite number above zero, from what is planned alone"
                )
        return np.array(values)


def reference_stress_of(specimen: Specimen) -> ReferenceStress:
    """The reference of a specimen; DatasetError, with the attribute to add, where its record does not say it."""
    known, visible = specimen_conditions(specimen), creep_output(specimen).visible
    scaling: LoadScaling | None = record_of(specimen).load_scaling
    if scaling is None:
        check_stated(specimen, "reference_stress", "which von Mises stress, MPa, stands for a test")
        growth = "by how much its output grows for each unit of strain at the reference stress"
        check_stated(specimen, "growth_per_strain", growth)
    return ReferenceStress(specimen, known, visible, scaling)
