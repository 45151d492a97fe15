"""Logarithmic strain of a point, its derivatives to the deformation gradient, and element forces and stiffness."""

from __future__ import annotations

from math import atanh, log, sqrt
from typing import NamedTuple

from numba import njit

from creepkit.arrays import Floats, Ints

SUM, DIFFERENCE, HOOP, SHEAR = range(4)
"""Places of the components of strain and stress."""


Three = tuple[float, float, float]


Four = tuple[float, float, float, float]


Five = tuple[float, float, float, float, float]


_SERIES = 0.05


_SHORT = 0.004
"""Below the first y the series of phi has 14 terms, below the second 7; what is left out is under 1e-17."""


class Kinematics(NamedTuple):
    """A point in its deformed state.

    F : deformation gradient. volume : det F. strain : the four strains.
    by_sum, by_difference, by_shear : derivatives of three strains to C11/2, C22/2, C12; by_hoop : of E33 to F33.
    m, e, c, b_m, b_q, b_mm, b_mq, b_qq : what second derivatives need; b_q is to q = (e^2 + c^2)/2.
    """

    F: Five
    volume: float
    strain: Four
    by_sum: Three
    by_difference: Three
    by_shear: Three
    by_hoop: float
    m: float
    e: float
    c: float
    b_m: float
    b_q: float
    b_mm: float
    b_mq: float
    b_qq: float


@njit(cache=True, error_model="numpy")
def phi_of(y: float) -> Three:
    """phi(y) = artanh(sqrt y)/sqrt y with its first and second derivatives."""
    if y < _SERIES:
        value, first, second = 0.0, 0.0, 0.0
        for k in range(6 if y < _SHORT else 13, 1, -1):
            coefficient = 1.0 / (2 * k + 1)
            value = value * y + coefficient
            first = first * y + k * coefficient
            second = second * y + k * (k - 1) * coefficient
        return (value * y + 1.0 / 3.0) * y + 1.0, first * y + 1.0 / 3.0, second
    root = sqrt(y)
    value = atanh(root) / root
    inverse = 1.0 / (1.0 - y)
    first = 0.5 * (inverse - value) / y
    return value, first, 0.5 * (inverse * inverse - 3.0 * first) / y


@njit(cache=True, error_model="numpy")
def kinematics(F: Five) -> Kinematics:
    """Strains and their derivatives; where the point is turned inside out, the volume is not above zero."""
    f11, f12, f21, f22, f33 = F
    c11, c22, c = f11 * f11 + f21 * f21, f12 * f12 + f22 * f22, f11 * f12 + f21 * f22
    m, e = 0.5 * (c11 + c22), 0.5 * (c11 - c22)
    area = f11 * f22 - f12 * f21
    if not (area > 0.0 and f33 > 0.0):
        none = (0.0, 0.0, 0.0)
        return Kinematics(F, -1.0, (0.0, 0.0, 0.0, 0.0), none, none, none, 0.0, m, e, c, 0.0, 0.0, 0.0, 0.0, 0.0)
    inverse = 1.0 / m
    cube = inverse * inverse * inverse
    y = (e * e + c * c) * inverse * inverse
    phi, phi1, phi2 = phi_of(y)
    b = phi * inverse
    # With q = (e^2 + c^2)/2: dy/dm = -2 y/m, dy/dq = 2/m^2.
    b_m = -(phi + 2.0 * y * phi1) * inverse * inverse
    b_q = 2.0 * phi1 * cube
    det = 1.0 / (area * area)
    a_m, a_e, a_c = m * det, -e * det, -c * det
    d_m, d_e, d_c = b_m * e, b + b_q * e * e, b_q * c * e
    x_m, x_e, x_c = b_m * c, b_q * e * c, b + b_q * c * c
    return Kinematics(
        F,
        area * f33,
        (log(area), b * e, log(f33), b * c),
        (a_m + a_e, a_m - a_e, a_c),
        (d_m + d_e, d_m - d_e, d_c),
        (x_m + x_e, x_m - x_e, x_c),
        1.0 / f33,
        m,
        e,
        c,
        b_m,
        b_q,
        (2.0 * phi + 10.0 * y * phi1 + 4.0 * y * y * phi2) * cube,
        -(6.0 * phi1 + 4.0 * y * phi2) * cube * inverse,
        4.0 * phi2 * cube * inverse * inverse,
    )


@njit(cache=True, error_model="numpy")
def energy_slopes(at: Kinematics, stress: Four) -> Four:
    """Derivatives of the energy to alpha: the second Piola-Kirchhoff stresses S11, S22, S12, and P33."""
    t, d, h, x = stress
    s, u, v = at.by_sum, at.by_difference, at.by_shear
    return (
        t * s[0] + d * u[0] + x * v[0],
        t * s[1] + d * u[1] + x * v[1],
        t * s[2] + d * u[2] + x * v[2],
        h * at.by_hoop,
    )


@njit(cache=True, error_model="numpy")
def to_gradient(F: Five, by_alpha: Four) -> Five:
    """Derivatives to F of what has the derivatives `by_alpha`."""
    x, y, z, h = by_alpha
    return F[0] * x + F[1] * z, F[1] * y + F[0] * z, F[2] * x + F[3] * z, F[3] * y + F[2] * z, h


@njit(cache=True, error_model="numpy")
def from_gradient(F: Five, change: Five) -> Four:
    """Change of alpha with a change of F."""
    a, b, c, d, h = change
    return F[0] * a + F[2] * c, F[1] * b + F[3] * d, F[1] * a + F[0] * b + F[3] * c + F[2] * d, h


@njit(cache=True, error_model="numpy")
def strain_change(at: Kinematics, change: Five) -> Four:
    """Change of the four strains with a change of F."""
    x, y, z, h = from_gradient(at.F, change)
    s, u, v = at.by_sum, at.by_difference, at.by_shear
    return (
        s[0] * x + s[1] * y + s[2] * z,
        u[0] * x + u[1] * y + u[2] * z,
        at.by_hoop * h,
        v[0] * x + v[1] * y + v[2] * z,
    )


@njit(cache=True, error_model="numpy")
def curvature(at: Kinematics, stress: Four) -> tuple[float, float, float, float, float, float, float]:
    """Second derivatives of the strains, weighted by the stresses: 11, 22, 12, 13, 23, 33 and 44 of alpha."""
    along, x, hoop, y = stress
    m, e, c = at.m, at.e, at.c
    det = 1.0 / (m * m - e * e - c * c)
    double = 2.0 * along * det * det
    work = x * e + y * c
    mm = along * det - double * m * m + at.b_mm * work
    me = double * m * e + at.b_mq * e * work + at.b_m * x
    mc = double * m * c + at.b_mq * c * work + at.b_m * y
    ee = -along * det - double * e * e + (at.b_qq * e * e + at.b_q) * work + 2.0 * at.b_q * e * x
    cc = -along * det - double * c * c + (at.b_qq * c * c + at.b_q) * work + 2.0 * at.b_q * c * y
    ec = -double * e * c + at.b_qq * e * c * work + at.b_q * (e * y + c * x)
    return mm + 2.0 * me + ee, mm - 2.0 * me + ee, mm - ee, mc + ec, mc - ec, cc, -hoop * at.by_hoop * at.by_hoop


@njit(cache=True, error_model="numpy")
def _row(at: Kinematics, moduli: Four) -> Four:
    """Moduli of one stress to the strains, turned into derivatives to alpha."""
    s, d, h, x = moduli
    a, u, v = at.by_sum, at.by_difference, at.by_shear
    return (
        s * a[0] + d * u[0] + x * v[0],
        s * a[1] + d * u[1] + x * v[1],
        s * a[2] + d * u[2] + x * v[2],
        h * at.by_hoop,
    )


@njit(cache=True, error_model="numpy")
def _sum(a: float, b: float, c: float, x: Four, y: Four, z: Four) -> Four:
    """The sum a x + b y + c z."""
    return (
        a * x[0] + b * y[0] + c * z[0],
        a * x[1] + b * y[1] + c * z[1],
        a * x[2] + b * y[2] + c * z[2],
        a * x[3] + b * y[3] + c * z[3],
    )


@njit(cache=True, error_model="numpy")
def piola_tangent(at: Kinematics, moduli: tuple[Four, Four, Four, Four], stress: Four, slopes: Four, A: Floats) -> None:
    """A = dP/dF, (5, 5), from the moduli dT/dE, which need not be symmetric; `slopes` as `energy_slopes` gives them."""
    along, across, hoop, shear = (
        _row(at, moduli[0]), _row(at, moduli[1]), _row(at, moduli[2]), _row(at, moduli[3]),
    )  # fmt: skip
    s, u, v = at.by_sum, at.by_difference, at.by_shear
    k11, k22, k12, k13, k23, k33, k44 = curvature(at, stress)
    a = _sum(s[0], u[0], v[0], along, across, shear)
    b = _sum(s[1], u[1], v[1], along, across, shear)
    c = _sum(s[2], u[2], v[2], along, across, shear)
    F, h = at.F, at.by_hoop
    x = to_gradient(F, (a[0] + k11, a[1] + k12, a[2] + k13, a[3]))
    y = to_gradient(F, (b[0] + k12, b[1] + k22, b[2] + k23, b[3]))
    z = to_gradient(F, (c[0] + k13, c[1] + k23, c[2] + k33, c[3]))
    w = to_gradient(F, (h * hoop[0], h * hoop[1], h * hoop[2], h * hoop[3] + k44))
    for k in range(5):
        A[0, k] = F[0] * x[k] + F[1] * z[k]
        A[1, k] = F[1] * y[k] + F[0] * z[k]
        A[2, k] = F[2] * x[k] + F[3] * z[k]
        A[3, k] = F[3] * y[k] + F[2] * z[k]
        A[4, k] = w[k]
    A[0, 0] += slopes[0]
    A[2, 2] += slopes[0]
    A[1, 1] += slopes[1]
    A[3, 3] += slopes[1]
    A[0, 1] += slopes[2]
    A[1, 0] += slopes[2]
    A[2, 3] += slopes[2]
    A[3, 2] += slopes[2]


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
