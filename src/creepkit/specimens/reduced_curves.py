"""The curves of a dimple over its deflection, as compiled code reads them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats

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


class Dimple(NamedTuple):
    """Curves (CURVES, grid + 2) of one dimple with their derivatives to the thickness, and the numbers of
    redistribution; D = (exp(x) - 1) offset on the grid, which is uniform in x with `step`.
    """

    curves: Floats
    slopes: Floats
    redistribution: Floats
    offset: float
    step: float


class Place(NamedTuple):
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
def place(deflection: Any, dimple: Dimple) -> Place:
    """Where a deflection, mm, lies; weights are of cubics that go on smoothly from one interval to the next."""
    position = np.log(1.0 + deflection / dimple.offset) / dimple.step
    last = dimple.curves.shape[1] - 3
    index = min(max(int(position.real), 0), last - 1)
    s = position - index
    if not position.real > 0.0:
        s = 0.0 * position
    elif position.real > last:
        s = 0.0 * position + 1.0
    w0, w1 = 0.5 * s * (s * (2.0 - s) - 1.0), 0.5 * (s * s * (3.0 * s - 5.0) + 2.0)
    return Place(index, s, w0, w1, 0.5 * s * (s * (4.0 - 3.0 * s) + 1.0), 0.5 * s * s * (s - 1.0))


@njit(cache=True, error_model="numpy")
def curve(which: int, at: Place, dimple: Dimple, thicker: Any) -> Any:
    """A curve there; thicker : mm."""
    c, i = dimple.curves, at.index
    value = at.w0 * c[which, i] + at.w1 * c[which, i + 1] + at.w2 * c[which, i + 2] + at.w3 * c[which, i + 3]
    if thicker != 0.0:
        c = dimple.slopes
        more = at.w0 * c[which, i] + at.w1 * c[which, i + 1] + at.w2 * c[which, i + 2] + at.w3 * c[which, i + 3]
        value += thicker * more
    return value


@njit(cache=True, error_model="numpy")
def slope(which: int, at: Place, dimple: Dimple, deflection: Any) -> Any:
    """Its derivative to D, 1/mm, real."""
    s, c, i = at.share.real, dimple.curves, at.index
    rise = 0.5 * (s * (4.0 - 3.0 * s) - 1.0) * c[which, i] + 0.5 * s * (9.0 * s - 10.0) * c[which, i + 1]
    rise += 0.5 * (s * (8.0 - 9.0 * s) + 1.0) * c[which, i + 2] + 0.5 * s * (3.0 * s - 2.0) * c[which, i + 3]
    return rise / (dimple.step * (dimple.offset + deflection.real))


@njit(cache=True, error_model="numpy")
def over_exponents(first: int, power: Any, at: Place, dimple: Dimple, thicker: Any) -> Any:
    """What the curves of the six exponents say of another one, power = n/(n + 2): the polynomial through them."""
    d0, d1, d2 = power - _PLACES[0], power - _PLACES[1], power - _PLACES[2]
    d3, d4, d5 = power - _PLACES[3], power - _PLACES[4], power - _PLACES[5]
    early, middle, late = d0 * d1, d2 * d3, d4 * d5
    total = (
        (_SCALES[0] * d1 * curve(first, at, dimple, thicker) + _SCALES[1] * d0 * curve(first + 1, at, dimple, thicker))
        * middle
        * late
    )
    total += (
        (
            _SCALES[2] * d3 * curve(first + 2, at, dimple, thicker)
            + _SCALES[3] * d2 * curve(first + 3, at, dimple, thicker)
        )
        * early
        * late
    )
    total += (
        (
            _SCALES[4] * d5 * curve(first + 4, at, dimple, thicker)
            + _SCALES[5] * d4 * curve(first + 5, at, dimple, thicker)
        )
        * early
        * middle
    )
    return total
