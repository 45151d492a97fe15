"""Small dense systems inside compiled code."""

from __future__ import annotations

from numba import njit

from creepkit.arrays import Floats


@njit(cache=True, error_model="numpy")
def solve_dense(matrix: Floats, right: Floats) -> bool:
    """Solve ``matrix x = right`` in place, x left in `right`; False when the matrix is singular.

    matrix : (n, n), destroyed; right : (n, columns). Gauss elimination with row pivoting.
    """
    size = matrix.shape[0]
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        pivot = matrix[best, k]
        if not abs(pivot) > 0.0:
            return False
        if best != k:
            _swap(matrix, best, k)
            _swap(right, best, k)
        for i in range(k + 1, size):
            factor = matrix[i, k] / pivot
            if factor != 0.0:
                _subtract(matrix, i, factor, k)
                _subtract(right, i, factor, k)
    for k in range(size - 1, -1, -1):
        for i in range(k + 1, size):
            _subtract(right, k, matrix[k, i], i)
        for j in range(right.shape[1]):
            right[k, j] /= matrix[k, k]
    return True


@njit(cache=True, error_model="numpy")
def _subtract(rows: Floats, i: int, factor: float, k: int) -> None:
    for j in range(rows.shape[1]):
        rows[i, j] -= factor * rows[k, j]


@njit(cache=True, error_model="numpy")
def _swap(rows: Floats, i: int, k: int) -> None:
    for j in range(rows.shape[1]):
        rows[i, j], rows[k, j] = rows[k, j], rows[i, j]
