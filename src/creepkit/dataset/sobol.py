"""A scrambled Sobol sequence whose rows do not depend on the block in which they are drawn.

Sobol (1967), USSR Comput. Math. Math. Phys. 7, 86; Owen's scrambling as in scipy.stats.qmc.
"""

from __future__ import annotations

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import DatasetError

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
