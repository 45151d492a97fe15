"""Element blocks: deformation from displacements, nodal forces and stiffness of a point, and where they go."""

from __future__ import annotations

from numba import njit

from creepkit.arrays import Floats, Ints
from creepkit.fem.strain import Five

_FAST = {"reassoc", "contract", "nsz"}


@njit(cache=True, error_model="numpy")
def clear(values: Floats) -> None:
    """Set a vector to zero."""
    for k in range(values.size):
        values[k] = 0.0


@njit(cache=True, error_model="numpy")
def clear_element(inner: Floats, element: Floats, stiff: bool) -> None:
    """Set an element's forces (2, 8), and its blocks (3, 8, 8) if they are wanted, to zero."""
    for i in range(2):
        for a in range(8):
            inner[i, a] = 0.0
    if stiff:
        for i in range(3):
            for a in range(8):
                for b in range(8):
                    element[i, a, b] = 0.0


@njit(cache=True, error_model="numpy")
def gather(elements: Ints, e: int, displacement: Floats, local: Floats) -> None:
    """Displacements (2, 8) of an element."""
    for a in range(8):
        node = elements[e, a]
        local[0, a] = displacement[2 * node]
        local[1, a] = displacement[2 * node + 1]


@njit(cache=True, error_model="numpy", fastmath=_FAST)
def deformation(by_r: Floats, by_z: Floats, over_r: Floats, e: int, g: int, local: Floats) -> Five:
    """Deformation gradient of a point from the displacements (2, 8) of its element."""
    f11, f12, f21, f22, f33 = 1.0, 0.0, 0.0, 1.0, 1.0
    for a in range(8):
        f11 += by_r[e, g, a] * local[0, a]
        f12 += by_z[e, g, a] * local[0, a]
        f33 += over_r[e, g, a] * local[0, a]
        f21 += by_r[e, g, a] * local[1, a]
        f22 += by_z[e, g, a] * local[1, a]
    return f11, f12, f21, f22, f33


@njit(cache=True, error_model="numpy", fastmath=_FAST)
def add_force(
    by_r: Floats, by_z: Floats, over_r: Floats, e: int, g: int, P: Five, weight: float, inner: Floats
) -> None:
    """Add the internal force of a point to (2, 8)."""
    p0, p1, p2, p3, p4 = weight * P[0], weight * P[1], weight * P[2], weight * P[3], weight * P[4]
    for a in range(8):
        inner[0, a] += by_r[e, g, a] * p0 + by_z[e, g, a] * p1 + over_r[e, g, a] * p4
        inner[1, a] += by_r[e, g, a] * p2 + by_z[e, g, a] * p3


@njit(cache=True, error_model="numpy", fastmath=_FAST)
def set_products(
    by_r: Floats, by_z: Floats, over_r: Floats, e: int, g: int, A: Floats, weight: float, products: Floats
) -> None:
    """Tangent times shape gradients of a point, (8, 8), into its half of `products` (16, 8)."""
    o = 8 * (g % 2)
    for b in range(8):
        x, y, h = weight * by_r[e, g, b], weight * by_z[e, g, b], weight * over_r[e, g, b]
        products[o, b] = A[0, 0] * x + A[0, 1] * y + A[0, 4] * h
        products[o + 1, b] = A[1, 0] * x + A[1, 1] * y + A[1, 4] * h
        products[o + 2, b] = A[4, 0] * x + A[4, 1] * y + A[4, 4] * h
        products[o + 3, b] = A[0, 2] * x + A[0, 3] * y
        products[o + 4, b] = A[1, 2] * x + A[1, 3] * y
        products[o + 5, b] = A[4, 2] * x + A[4, 3] * y
        products[o + 6, b] = A[2, 2] * x + A[2, 3] * y
        products[o + 7, b] = A[3, 2] * x + A[3, 3] * y


@njit(cache=True, error_model="numpy", fastmath=_FAST)
def add_stiffness(by_r: Floats, by_z: Floats, over_r: Floats, e: int, g: int, p: Floats, element: Floats) -> None:
    """Add the symmetric stiffness of points g - 1 and g to the blocks rr, rz, zz of (3, 8, 8).

    Two at a time, since loads and stores of the blocks cost more than the products.
    """
    for a in range(8):
        x, y, h = by_r[e, g - 1, a], by_z[e, g - 1, a], over_r[e, g - 1, a]
        u, v, w = by_r[e, g, a], by_z[e, g, a], over_r[e, g, a]
        for b in range(8):
            rr = x * p[0, b] + y * p[1, b] + h * p[2, b] + u * p[8, b] + v * p[9, b] + w * p[10, b]
            rz = x * p[3, b] + y * p[4, b] + h * p[5, b] + u * p[11, b] + v * p[12, b] + w * p[13, b]
            zz = x * p[6, b] + y * p[7, b] + u * p[14, b] + v * p[15, b]
            element[0, a, b] += rr
            element[1, a, b] += rz
            element[2, a, b] += zz


@njit(cache=True, error_model="numpy")
def scatter_force(elements: Ints, equations: Ints, e: int, inner: Floats, residual: Floats) -> None:
    """Add an element's forces (2, 8) to its equations."""
    for a in range(8):
        for i in range(2):
            equation = equations[2 * elements[e, a] + i]
            if equation >= 0:
                residual[equation] += inner[i, a]


@njit(cache=True, error_model="numpy")
def scatter_stiffness(places: Ints, e: int, element: Floats, flat: Floats) -> None:
    """Add an element's blocks rr, rz, zz to the band."""
    for a in range(8):
        for b in range(a, 8):
            flat[places[e, 0, a, b]] += element[0, a, b]
            flat[places[e, 2, a, b]] += element[2, a, b]
        for b in range(8):
            flat[places[e, 1, a, b]] += element[1, a, b]
