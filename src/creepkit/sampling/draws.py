"""Draws of a sampling design: the scrambled Sobol sequence, drawn rows, and which terms of a law a row contains.

Rows of the sequence do not depend on the block in which they are drawn. Sobol (1967), USSR Comput. Math. Math. Phys. 7,
86; Owen scrambling as in scipy.stats.qmc.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.special import gammaincinv

from creepkit.arrays import Bools, Floats, frozen
from creepkit.errors import DatasetError, nearest

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
        object.__setattr__(self, "parameters", frozen(self.parameters))
        object.__setattr__(self, "conditions", frozen(self.conditions))

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
