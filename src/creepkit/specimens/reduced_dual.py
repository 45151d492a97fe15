"""Functions of floats, or of complex numbers whose imaginary parts are derivatives times a tiny number.

Of such numbers only the first order is wanted, which spares the sines and cosines of the functions of complex numbers.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types
from numba.extending import overload


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
