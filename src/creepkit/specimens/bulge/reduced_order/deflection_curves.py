"""Tabulated curves of a dimple over its deflection, for real arguments and for complex-step derivatives."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit, types
from numba.extending import overload

from creepkit.arrays import Floats


def exp(x: Any) -> Any:
    """Return e to the x."""
    return np.exp(x)


def log(x: Any) -> Any:
    """Return ln x."""
    return np.log(x)


def sqrt(x: Any) -> Any:
    """Return the root of x."""
    return np.sqrt(x)


def _exp(x: Any) -> Any:
    def real(x: Any) -> Any:
        return math.exp(x)

    def first_order(x: Any) -> Any:
        value = math.exp(x.real)
        return complex(value, value * x.imag)

    return first_order if isinstance(x, types.Complex) else real


def _log(x: Any) -> Any:
    def real(x: Any) -> Any:
        return np.log(x)

    def first_order(x: Any) -> Any:
        return complex(np.log(x.real), x.imag / x.real)

    return first_order if isinstance(x, types.Complex) else real


def _sqrt(x: Any) -> Any:
    def real(x: Any) -> Any:
        return np.sqrt(x)

    def first_order(x: Any) -> Any:
        value = np.sqrt(x.real)
        return complex(value, 0.5 * x.imag / value)

    return first_order if isinstance(x, types.Complex) else real


for _function, _meaning in ((exp, _exp), (log, _log), (sqrt, _sqrt)):
    overload(_function)(_meaning)


EXPONENTS = (0.5, 1.0, 3.0, 5.0, 8.0, 13.0)
"""Of the Norton runs: those of creep laws of metals, and what hardening and hyperbolic sines make of them."""


_PLACES = np.array([n / (n + 2.0) for n in EXPONENTS])
"""Where they stand, about evenly, on the axis along which curves are interpolated."""


_SCALES = np.array([1.0 / np.prod([a - b for b in _PLACES if b != a]) for a in _PLACES])
"""Of Lagrange's polynomials through them."""


LOG_STRESS, LOG_GROWTH, AMPLITUDE, RESIDUAL = range(4)


WIDTH, SHAPE, ELASTIC_WIDTH = (RESIDUAL + k * len(EXPONENTS) for k in (1, 2, 3))


ELASTIC_SHAPE = ELASTIC_WIDTH + 1
"""Of the curves over D: ln k, ln kappa, size of redistribution, then what is left of the growth, width and shape, of
each exponent, and width and shape of an elastic dimple."""


CURVES = ELASTIC_SHAPE + 1


class DimpleCurves(NamedTuple):
    """Curves (grid + 2, CURVES) of one dimple with their derivatives to the thickness, and the numbers of
    redistribution; D = (exp(x) - 1) offset on the grid, which is uniform in x with `step`.
    """

    curves: Floats
    slopes: Floats
    redistribution: Floats
    offset: float
    step: float


class GridPosition(NamedTuple):
    """Where a deflection lies: the first of four points of the grid, the share of the interval between the second and
    the third that lies behind, and weights of the four.
    """

    index: Any
    share: Any
    w0: Any
    w1: Any
    w2: Any
    w3: Any


@njit(cache=True, error_model="numpy")
def grid_position(deflection: Any, dimple: DimpleCurves) -> GridPosition:
    """Where a deflection, mm, lies; weights are of cubics that go on smoothly from one interval to the next."""
    position = log(1.0 + deflection * (1.0 / dimple.offset)) * (1.0 / dimple.step)
    last = dimple.curves.shape[0] - 3
    index = min(max(int(position.real), 0), last - 1)
    s = position - index
    if not position.real > 0.0:
        s = 0.0 * position
    elif position.real > last:
        s = 0.0 * position + 1.0
    w0, w1 = 0.5 * s * (s * (2.0 - s) - 1.0), 0.5 * (s * s * (3.0 * s - 5.0) + 2.0)
    return GridPosition(index, s, w0, w1, 0.5 * s * (s * (4.0 - 3.0 * s) + 1.0), 0.5 * s * s * (s - 1.0))


@njit(cache=True, error_model="numpy")
def curve_value(which: int, at: GridPosition, dimple: DimpleCurves, thickness_change: Any) -> Any:
    """A curve there; thickness_change : mm."""
    value = _blended(dimple.curves, which, at)
    return value if thickness_change == 0.0 else value + thickness_change * _blended(dimple.slopes, which, at)


@njit(cache=True, error_model="numpy")
def _blended(c: Floats, k: int, at: GridPosition) -> Any:
    i = at.index
    return at.w0 * c[i, k] + at.w1 * c[i + 1, k] + at.w2 * c[i + 2, k] + at.w3 * c[i + 3, k]


@njit(cache=True, error_model="numpy")
def write_curves(
    first: int, last: int, at: GridPosition, dimple: DimpleCurves, thickness_change: Any, values: Any
) -> None:
    """Write the curves from `first` to before `last` there into values (CURVES,); thickness_change : mm.

    Many at once: numba counts references to arrays at each call, which costs more than a curve.
    """
    i, w0, w1, w2, w3 = at.index, at.w0, at.w1, at.w2, at.w3
    c = dimple.curves
    for k in range(first, last):
        values[k] = w0 * c[i, k] + w1 * c[i + 1, k] + w2 * c[i + 2, k] + w3 * c[i + 3, k]
    if thickness_change != 0.0:
        c = dimple.slopes
        for k in range(first, last):
            values[k] += thickness_change * (w0 * c[i, k] + w1 * c[i + 1, k] + w2 * c[i + 2, k] + w3 * c[i + 3, k])


@njit(cache=True, error_model="numpy")
def curve_slope(which: int, at: GridPosition, dimple: DimpleCurves, deflection: float) -> Any:
    """Its derivative to D, 1/mm."""
    s, c, i = at.share, dimple.curves, at.index
    rise = 0.5 * (s * (4.0 - 3.0 * s) - 1.0) * c[i, which] + 0.5 * s * (9.0 * s - 10.0) * c[i + 1, which]
    rise += 0.5 * (s * (8.0 - 9.0 * s) + 1.0) * c[i + 2, which] + 0.5 * s * (3.0 * s - 2.0) * c[i + 3, which]
    return rise / (dimple.step * (dimple.offset + deflection))


@njit(cache=True, error_model="numpy")
def interpolate_exponents(first: int, power: Any, values: Any) -> Any:
    """What the six exponents' values, from `first` on, say of another one, power = n/(n + 2): the polynomial."""
    d0, d1, d2 = power - _PLACES[0], power - _PLACES[1], power - _PLACES[2]
    d3, d4, d5 = power - _PLACES[3], power - _PLACES[4], power - _PLACES[5]
    early, middle, late = d0 * d1, d2 * d3, d4 * d5
    v = values[first : first + len(EXPONENTS)]
    total = (_SCALES[0] * d1 * v[0] + _SCALES[1] * d0 * v[1]) * middle * late
    total += (_SCALES[2] * d3 * v[2] + _SCALES[3] * d2 * v[3]) * early * late
    return total + (_SCALES[4] * d5 * v[4] + _SCALES[5] * d4 * v[5]) * early * middle
