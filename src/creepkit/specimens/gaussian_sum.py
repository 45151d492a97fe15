"""The sum of squares between profiles and a generalised Gaussian, compiled, with first and second derivatives.

In polar coordinates both forms are one: D exp(-|x/S|^p - |y/S|^p) = D exp(-(r/S)^p g), g = |cos a|^p + |sin a|^p, and
the single angle a = 0 gives D exp(-(r/S)^p). Unknowns are D, ln S and ln p; with e = ln((r/S)^p g) and q = exp(e),

    f = D exp(-q),   df/du = -f q de/du,   d2f/dudv = f q ((q - 1) de/du de/dv - d2e/dudv)   for u, v of ln S and ln p.
"""

from __future__ import annotations

from math import exp, sqrt
from typing import NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats

LOG_OF_ZERO = -700.0
"""Stands for ln 0: exp(LOG_OF_ZERO p) is nothing beside 1 for any admitted p, and nothing times -700 still is."""

_FARTHEST = 6.0  # exp(-exp(6)) = 1e-175 is nothing, and its products with q still are numbers


class PolarGrid(NamedTuple):
    """Where profiles are looked at.

    log_radius : (radii,) ln(r / window). radial : (radii,) their weights.
    log_cosine, log_sine : (angles,) logarithms of |cos a| and |sin a|. angular : (angles,) their weights.
    """

    log_radius: Floats
    radial: Floats
    log_cosine: Floats
    log_sine: Floats
    angular: Floats


class NormalEquations(NamedTuple):
    """Half the sum of squares at one place: `squares` (1,).

    slope : (3,) its derivatives. matrix : (3, 3) its second derivatives, the upper half. diagonal : (3,) of the part of
        `matrix` that knows no residuals, as in the method of Gauss and Newton: never negative.
    """

    slope: Floats
    matrix: Floats
    diagonal: Floats
    squares: Floats


@njit(cache=True, error_model="numpy")
def _angle(grid: PolarGrid, p: float, j: int) -> tuple[float, float, float]:
    """g of an angle, and the first and second derivative of ln g to p."""
    cosine, sine = exp(p * grid.log_cosine[j]), exp(p * grid.log_sine[j])
    g = cosine + sine
    first = (cosine * grid.log_cosine[j] + sine * grid.log_sine[j]) / g
    second = (cosine * grid.log_cosine[j] ** 2 + sine * grid.log_sine[j] ** 2) / g - first * first
    return g, first, second


@njit(cache=True, error_model="numpy")
def _bell(far: float, p: float, g: float) -> tuple[float, float]:
    """q and exp(-q) at the distance `far` = ln(r/S)."""
    q = g * exp(min(p * far, _FARTHEST))
    return q, exp(-q)


@njit(cache=True, error_model="numpy")
def best_amplitude(grid: PolarGrid, y: Floats, x: Floats) -> float:
    """D of the least squares at given ln S and ln p: D is linear."""
    p = exp(x[2])
    product, square = 0.0, 0.0
    for j in range(grid.angular.size):
        g, _, _ = _angle(grid, p, j)
        for i in range(y.size):
            _, m = _bell(grid.log_radius[i] - x[1], p, g)
            product += grid.angular[j] * grid.radial[i] * m * y[i]
            square += grid.angular[j] * grid.radial[i] * m * m
    return product / square


@njit(cache=True, error_model="numpy")
def sum_up(grid: PolarGrid, y: Floats, x: Floats, normal: NormalEquations) -> None:
    """Half the sum of squares at x = (D, ln S, ln p), and its derivatives, into `normal`."""
    p, squares = exp(x[2]), 0.0
    slope, matrix, diagonal = normal.slope, normal.matrix, normal.diagonal
    for v in range(3):
        slope[v], diagonal[v] = 0.0, 0.0
        for w in range(3):
            matrix[v, w] = 0.0
    for j in range(grid.angular.size):
        g, first, second = _angle(grid, p, j)
        for i in range(y.size):
            weight = grid.angular[j] * grid.radial[i]
            far = grid.log_radius[i] - x[1]
            q, m = _bell(far, p, g)
            left, steep = weight * (x[0] * m - y[i]), p * (far + first)
            fq = x[0] * m * q
            fs, fp = fq * p, -fq * steep
            squares += left * (x[0] * m - y[i])
            slope[0] += left * m
            slope[1] += left * fs
            slope[2] += left * fp
            diagonal[0] += weight * m * m
            diagonal[1] += weight * fs * fs
            diagonal[2] += weight * fp * fp
            matrix[0, 1] += weight * m * fs + left * m * q * p
            matrix[0, 2] += weight * m * fp - left * m * q * steep
            matrix[1, 1] += left * fq * (q - 1.0) * p * p
            matrix[1, 2] += weight * fs * fp + left * fq * (p - (q - 1.0) * p * steep)
            matrix[2, 2] += left * fq * ((q - 1.0) * steep * steep - p * p * second - steep)
    for v in range(3):
        matrix[v, v] += diagonal[v]
    normal.squares[0] = 0.5 * squares


@njit(cache=True, error_model="numpy")
def solve_damped(normal: NormalEquations, damping: float, solution: Floats) -> bool:
    """Cholesky's method for the damped matrix and the slope; false where the matrix is not positive definite."""
    lower = np.empty((3, 3))
    for a in range(3):
        for b in range(a + 1):
            total = normal.matrix[b, a] + (damping * normal.diagonal[a] if a == b else 0.0)
            for c in range(b):
                total -= lower[a, c] * lower[b, c]
            if a > b:
                lower[a, b] = total / lower[b, b]
            elif total > 1e-13 * normal.diagonal[a]:
                lower[a, a] = sqrt(total)
            else:
                return False
        solution[a] = normal.slope[a]
        for c in range(a):
            solution[a] -= lower[a, c] * solution[c]
        solution[a] /= lower[a, a]
    for a in range(2, -1, -1):
        for c in range(a + 1, 3):
            solution[a] -= lower[c, a] * solution[c]
        solution[a] /= lower[a, a]
    return True


@njit(cache=True, error_model="numpy")
def derivatives_to_profile(grid: PolarGrid, x: Floats, normal: NormalEquations, pull: Floats) -> None:
    """Derivatives (3, radii) of x = (D, ln S, ln p) to the profile, `normal` being that of the answer."""
    p, inverse, solution = exp(x[2]), np.empty((3, 3)), np.empty(3)
    for v in range(3):
        normal.slope[0], normal.slope[1], normal.slope[2] = 0.0, 0.0, 0.0
        normal.slope[v] = 1.0
        solve_damped(normal, 0.0, solution)
        for w in range(3):
            inverse[v, w] = solution[w]
    for v in range(pull.shape[0]):
        for i in range(pull.shape[1]):
            pull[v, i] = 0.0
    for j in range(grid.angular.size):
        g, first, _ = _angle(grid, p, j)
        for i in range(pull.shape[1]):
            far = grid.log_radius[i] - x[1]
            q, m = _bell(far, p, g)
            weight = grid.angular[j] * grid.radial[i] * m
            fq = x[0] * q * p
            for v in range(3):
                a, b, c = inverse[v, 0], inverse[v, 1], inverse[v, 2]
                pull[v, i] += weight * (a + fq * (b - c * (far + first)))
