"""Correlations of the noise of two outputs in one frame, as a matrix."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from creepkit.arrays import Floats


def correlation_matrix(correlations: Mapping[tuple[str, str], float], names: Sequence[str] = ()) -> Floats:
    """(names, names), ones on its diagonal; names : in order, by default those of the pairs."""
    order = list(names) or list(dict.fromkeys(name for pair in correlations for name in pair))
    matrix = np.eye(len(order))
    for (first, second), value in correlations.items():
        i, j = order.index(first), order.index(second)
        matrix[i, j] = matrix[j, i] = value
    return matrix


def can_hold_together(correlations: Mapping[tuple[str, str], float]) -> bool:
    """Whether some noise has these correlations: their matrix is finite and positive definite."""
    matrix = correlation_matrix(correlations)
    return bool(np.isfinite(matrix).all() and (np.linalg.eigvalsh(matrix) > 0.0).all())
