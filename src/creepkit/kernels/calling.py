"""Compiled entries called from Python, through their C pointers."""

from __future__ import annotations

import ctypes
from typing import Literal

import numpy as np

from creepkit.arrays import Floats
from creepkit.kernels.interface import CompiledLaw

_DOUBLE_POINTER = ctypes.POINTER(ctypes.c_double)
_C_FUNCTION = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, _DOUBLE_POINTER, _DOUBLE_POINTER, _DOUBLE_POINTER)


def call_entry(
    law: CompiledLaw, entry: Literal["rate", "update", "sensitivity"], points: Floats, theta: Floats
) -> tuple[Floats, int]:
    """Return an entry's output, (rows, columns) as `interface` lays it out, and its flags.

    points : (rows, 6 + S); theta : (P,).
    """
    points, theta = np.ascontiguousarray(points, float), np.ascontiguousarray(theta, float)
    rows, width = points.shape
    columns = {"rate": 1, "update": 1 + width, "sensitivity": 1 + width + theta.size}[entry]
    out = np.empty((rows, (1 + law.states) * columns))
    pointers = (array.ctypes.data_as(_DOUBLE_POINTER) for array in (points, theta, out))
    return out, int(_C_FUNCTION(getattr(law, entry).address)(rows, *pointers))
