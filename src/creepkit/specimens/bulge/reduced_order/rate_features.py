"""Rate features: creep rates around a point of a trajectory over the rate there, and their derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from creepkit.arrays import Floats
from creepkit.kernels.interface import MEAN_STRESS, PRINCIPAL_STRESS, STRAIN, STRESS, data_pointer

_LARGEST = 5.0
"""Decades; features are bent towards it smoothly."""


_LOG_10 = float(np.log(10.0))


@njit(cache=True, error_model="numpy")
def rate_features(
    rate: Any,
    theta: Floats,
    point: Floats,
    log_rate: float,
    stress_factors: Floats,
    strain_factors: Floats,
    points: Floats,
    law_values: Floats,
    out: Floats,
) -> None:
    """log10 of the rate at (strain factors) x (stress factors) of a point over the rate there; log_rate : ln of that.

    points (6 + S, features), law_values (1 + S, features) : workspace for the law.
    """
    _around(point, stress_factors, strain_factors, points)
    features = points.shape[1]
    rate(features, data_pointer(points), data_pointer(theta), data_pointer(law_values))
    for k in range(features):
        out[k] = (np.log(max(law_values[0, k], 1e-300)) - log_rate) / _LOG_10
    for k in range(features):
        out[k] /= _bent(out[k])


@njit(cache=True, error_model="numpy")
def _bent(value: float) -> float:
    """(1 + (value / largest)^4)^(1/4)."""
    square = (value / _LARGEST) * (value / _LARGEST)
    return float(np.sqrt(np.sqrt(1.0 + square * square)))


@njit(cache=True, error_model="numpy")
def _around(point: Floats, stress_factors: Floats, strain_factors: Floats, points: Floats) -> None:
    """Write the point (6 + S,) for all factors, (6 + S, features)."""
    k = 0
    for c in strain_factors:
        for s in stress_factors:
            for i in range(point.size):
                points[i, k] = point[i]
            for i in (STRESS, PRINCIPAL_STRESS, MEAN_STRESS):
                points[i, k] *= s
            points[STRAIN, k] *= c
            k += 1


@njit(cache=True, error_model="numpy")
def rate_feature_derivatives(
    sensitivity: Any,
    theta: Floats,
    point: Floats,
    log_rate: float,
    changes: Floats,
    log_rate_changes: Floats,
    stress_factors: Floats,
    strain_factors: Floats,
    points: Floats,
    law_values: Floats,
    out: Floats,
) -> None:
    """Derivatives of the features, (features, directions), the parameters first.

    changes : (directions, 6 + S) of the point; log_rate_changes : (directions,) of ln of the rate there. points
    (6 + S, features), law_values (columns of `sensitivity`, features) : workspace for the law.
    """
    _around(point, stress_factors, strain_factors, points)
    features = points.shape[1]
    sensitivity(features, data_pointer(points), data_pointer(theta), data_pointer(law_values))
    width, parameters = point.size, theta.size
    outputs = width - 5  # the rate, then each state's
    for k in range(features):
        rate = max(law_values[0, k], 1e-300)
        value = (np.log(rate) - log_rate) / _LOG_10
        bend = _bent(value)
        scale = 1.0 / (bend * bend * bend * bend * bend * _LOG_10)
        s, c = stress_factors[k % stress_factors.size], strain_factors[k // stress_factors.size]
        for i in range(width):
            law_values[outputs + i, k] *= (
                s if i in (STRESS, PRINCIPAL_STRESS, MEAN_STRESS) else (c if i == STRAIN else 1.0)
            )
        for p in range(changes.shape[0]):
            total = law_values[outputs * (1 + width) + p, k] if p < parameters else 0.0
            for i in range(width):
                total += law_values[outputs + i, k] * changes[p, i]
            out[k, p] = scale * (total / rate - log_rate_changes[p])
