"""Which parts of a law a sample has, and which share of its rate each gives."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from scipy.special import gammaincinv

from creepkit.arrays import Bools, Floats

CONCENTRATION = 0.7
"""Of the Dirichlet distribution of shares: below 1 one part tends to lead."""

TERM_COUNT_PROBABILITIES = (0.6, 0.3, 0.1)
"""Shares of samples with one, two and three parts, unless a design says otherwise."""

SELECTION_DIMENSIONS = 2
"""Coordinates that the choice of parts takes; shares take one a part."""


def active_terms(unit_coordinates: Floats, group_count: int, count_probabilities: tuple[float, ...] = TERM_COUNT_PROBABILITIES) -> Bools:
    """Which parts are there, (rows, parts), from coordinates (rows, 2): how many, then which of the ways to choose."""
    weights = np.array(count_probabilities[:group_count]) / sum(count_probabilities[:group_count])
    subsets = (members for k in range(1, len(weights) + 1) for members in combinations(range(group_count), k))
    masks = [np.eye(group_count, dtype=bool)[list(chosen)].any(axis=0) for chosen in subsets]
    sizes = np.array([mask.sum() for mask in masks])
    first = np.searchsorted(sizes, np.arange(1, len(weights) + 2))
    count = np.minimum(np.searchsorted(np.cumsum(weights), unit_coordinates[:, 0], side="right"), len(weights) - 1)
    start, stop = first[count], first[count + 1]
    chosen = start + np.minimum((unit_coordinates[:, 1] * (stop - start)).astype(int), stop - start - 1)
    return np.asarray(np.array(masks)[chosen])


def ln_term_fractions(unit_coordinates: Floats, active: Bools) -> Floats:
    """ln of the share of each part, (rows, parts), -inf where it is not there; Dirichlet by gamma quantiles."""
    sizes = np.where(active, gammaincinv(CONCENTRATION, np.clip(unit_coordinates, 1e-9, 1 - 1e-9)), 0.0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(sizes / sizes.sum(axis=1, keepdims=True)))
