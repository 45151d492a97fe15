"""Banded factorisations in compiled code: Cholesky for the tangent made symmetric, LU for the exact one.

Symmetric matrices are kept as columns below the diagonal, ``band[j, k] = K[j + k, j]``; four columns are eliminated
at a time, so that each entry is loaded once for four of them. Rows of zeros (with ones on the diagonal up to a multiple
of four) pad the end, and zeros the side, so that no loop asks where the matrix stops.
"""

from __future__ import annotations

from math import sqrt

from numba import njit

from creepkit.arrays import Floats

BLOCK = 4
"""Columns eliminated at a time; also the number of zeros at the side of the band."""

_FAST = {"reassoc", "contract", "nsz"}


@njit(cache=True, error_model="numpy")
def padded(size: int) -> int:
    """Rows that are eliminated for a matrix of `size`."""
    return (size + BLOCK - 1) // BLOCK * BLOCK


@njit(cache=True, error_model="numpy", fastmath=_FAST)
def factorize(band: Floats, size: int, width: int, block: Floats) -> bool:
    """Cholesky factor in place, its diagonal as reciprocals; False when the matrix is not positive definite.

    band : (padded(size) + width + BLOCK, width + 1 + BLOCK); width : half-bandwidth; block : (BLOCK, width + 1) room.
    """
    for j in range(size, padded(size)):
        band[j, 0] = 1.0
    for j in range(0, padded(size), BLOCK):
        for q in range(BLOCK):
            if not _column(band, j + q, q, width):
                return False
            for k in range(BLOCK - 1 - q):
                block[q, width - k] = 0.0
            for k in range(width - (BLOCK - 1 - q) + 1):
                block[q, k] = band[j + q, k + BLOCK - 1 - q]
        for q in range(BLOCK):
            band[j + q, 0] = 1.0 / band[j + q, 0]
        for i in range(1, width + 1):
            fa, fb, fc, fd = block[0, i], block[1, i], block[2, i], block[3, i]
            target = band[j + BLOCK - 1 + i]
            for k in range(width - i + 1):
                target[k] -= fa * block[0, i + k] + fb * block[1, i + k] + fc * block[2, i + k] + fd * block[3, i + k]
    return True


@njit(cache=True, error_model="numpy", fastmath=_FAST)
def _column(band: Floats, j: int, before: int, width: int) -> bool:
    """Finish column `j`, the `before` columns of its block being done."""
    target = band[j]
    for p in range(1, before + 1):
        source = band[j - p]
        factor = source[p]
        for k in range(width + 1):
            target[k] -= factor * source[p + k]
    if not target[0] > 0.0:
        return False
    inverse = 1.0 / sqrt(target[0])
    for k in range(width + 1):
        target[k] *= inverse
    return True


@njit(cache=True, error_model="numpy", fastmath=_FAST)
def solve_factorized(band: Floats, size: int, width: int, x: Floats) -> None:
    """Overwrite ``x`` (at least size + width,) by the solution; diagonals of the factor are kept as reciprocals."""
    for j in range(size, x.size):
        x[j] = 0.0
    for j in range(size):
        value = x[j] * band[j, 0]
        x[j] = value
        column, below = band[j], x[j:]
        for k in range(1, width + 1):
            below[k] -= value * column[k]
    for j in range(size, x.size):
        x[j] = 0.0
    for j in range(size - 1, -1, -1):
        column, below = band[j], x[j:]
        total = x[j]
        for k in range(1, width + 1):
            total -= column[k] * below[k]
        x[j] = total * band[j, 0]


@njit(cache=True, error_model="numpy", fastmath=_FAST)
def eliminate_rows(rows: Floats, size: int, width: int) -> bool:
    """LU factors in place, without pivoting; False when a pivot vanishes.

    rows : (size, 2 width + 1), ``rows[i, width + j - i] = K[i, j]``.
    """
    for i in range(size):
        pivot = rows[i, width]
        if pivot == 0.0:
            return False
        inverse = 1.0 / pivot
        source = rows[i, width + 1 :]
        for r in range(i + 1, min(i + width + 1, size)):
            offset = width - (r - i)
            factor = rows[r, offset] * inverse
            rows[r, offset] = factor
            target = rows[r, offset + 1 :]
            for k in range(width):
                target[k] -= factor * source[k]
    return True


@njit(cache=True, error_model="numpy", fastmath=_FAST)
def solve_rows(rows: Floats, size: int, width: int, x: Floats) -> None:
    """Overwrite ``x`` (size, columns) by the solutions; fastest for a multiple of 16 columns."""
    columns = x.shape[1]
    for i in range(size):
        for r in range(i + 1, min(i + width + 1, size)):
            factor = rows[r, width - (r - i)]
            for c in range(columns):
                x[r, c] -= factor * x[i, c]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, min(i + width + 1, size)):
            factor = rows[i, width + j - i]
            for c in range(columns):
                x[i, c] -= factor * x[j, c]
        inverse = 1.0 / rows[i, width]
        for c in range(columns):
            x[i, c] *= inverse
