"""The finite element model as compiled code reads it: equation numbers, banded matrices and their factors."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats, Ints
from creepkit.errors import SolveError
from creepkit.fem.mesh import Mesh, discretize

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

    band : (padded(size) + width + BLOCK, width + 1 + BLOCK) the matrix; width : half-bandwidth.
    block : (BLOCK, width + 1) workspace.
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


class FiniteElementModel(NamedTuple):
    """What compiled code knows of a mesh; displacements are kept as (2 nodes,) numbers, u_r and u_z in turn.

    nodes : (nodes, 2) mm. elements : (elements, 8). by_radius, by_height, over_radius : (elements, 4, 8), weights :
        (elements, 4), as in `fem.mesh`.
    equations : (2 nodes,) number of the equation of a displacement, -1 where it is held.
    size, width : number of equations, half-bandwidth.
    places : (elements, 3, 8, 8) of an element's rr, rz, zz blocks in the symmetric band, laid flat; the last place is
        nobody's and takes what belongs to held displacements.
    pressed : (edges, 3) nodes; pressed_places : (edges, 3, 3, 3) of a side's rr, rz, zz blocks.
    top : (top,) nodes of the observed surface.
    """

    nodes: Floats
    elements: Ints
    by_radius: Floats
    by_height: Floats
    over_radius: Floats
    weights: Floats
    equations: Ints
    size: int
    width: int
    places: Ints
    pressed: Ints
    pressed_places: Ints
    top: Ints


def finite_element_model(mesh: Mesh) -> FiniteElementModel:
    """Prepare a mesh; refuse one that nothing holds or that is inverted."""
    at = discretize(mesh)
    free = ~mesh.held.ravel()
    if free.all() or not mesh.held[:, 1].any():
        raise SolveError("nothing holds the mesh along its axis; hold u_z somewhere")
    equations = np.where(free, np.cumsum(free) - 1, -1)
    both = np.stack([2 * mesh.elements, 2 * mesh.elements + 1], axis=1)
    numbers = equations[both]
    width = _half_bandwidth(numbers.reshape(len(numbers), 16))
    sides = equations[np.stack([2 * mesh.pressed, 2 * mesh.pressed + 1], axis=1)]
    size = int(free.sum())
    return FiniteElementModel(
        nodes=mesh.nodes,
        elements=mesh.elements,
        by_radius=at.by_radius,
        by_height=at.by_height,
        over_radius=np.ascontiguousarray(at.over_radius),
        weights=np.ascontiguousarray(at.weights),
        equations=equations,
        size=size,
        width=width,
        places=_places(numbers, size, width),
        pressed=mesh.pressed,
        pressed_places=_places(sides, size, width),
        top=mesh.top,
    )


def band_shape(size: int, width: int) -> tuple[int, int]:
    """Shape of the symmetric band with its padding (see the module)."""
    return (size + BLOCK - 1) // BLOCK * BLOCK + width + BLOCK, width + 1 + BLOCK


def _half_bandwidth(numbers: Ints) -> int:
    """Largest distance between two equations of one element."""
    high = numbers.max(axis=1)
    low = np.where(numbers >= 0, numbers, np.iinfo(np.int64).max).min(axis=1)
    return int(np.max(np.where(high >= 0, high - low, 0), initial=0))


def _places(numbers: Ints, size: int, width: int) -> Ints:
    """Flat places in the band of the blocks rr, rz, zz; numbers : (elements, 2, nodes)."""
    rows, columns = band_shape(size, width)
    blocks = []
    for i, j in ((0, 0), (0, 1), (1, 1)):
        one, other = numbers[:, i, :, None], numbers[:, j, None, :]
        low, high = np.minimum(one, other), np.maximum(one, other)
        blocks.append(np.where(low >= 0, low * columns + high - low, rows * columns))
    return np.ascontiguousarray(np.stack(blocks, axis=1))
