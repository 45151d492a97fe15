"""The compiled interface of a law: what `integration` and `fem` see of it (no sympy here).

An entry is a C function ``int64 entry(int64 rows, double *x, double *theta, double *out)`` that evaluates a law at
`rows` points at once. Arrays are contiguous, and the points are their last axis, so that vectors of points are read and
written as they lie in memory. With S states and P parameters:

x : (6 + S, rows) stress MPa, strain, time s, temperature K, largest principal stress MPa, mean stress MPa, states.
theta : (P,) internal parameters, the natural logarithm where the scale is log; -inf there switches the term off
    (the mask for {0}).
out : (columns, rows),
    rate        1 + S                     rate 1/s, then each state's rate;
    update      (1 + S) (1 + 6 + S)       [ln rate, state rates], then their derivatives to x, row by row;
    sensitivity (1 + S) (1 + 6 + S + P)   [rate, state rates], then derivatives to x, then derivatives to theta.
The returned flags add up: 1 a rate is not finite, 2 a derivative is not finite.

Points are evaluated eight at a time, as vectors, and what is left one by one: callers give 8 points or 1. The two ways
round differently. Arrays that begin at multiples of 64 bytes are read and written fastest.

`update` gives ln rate because Newton's method is nearly linear in it and nothing overflows.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from creepkit.arrays import Floats

POINT_SIZE = 6


STRESS, STRAIN, TIME, TEMPERATURE, PRINCIPAL_STRESS, MEAN_STRESS = range(POINT_SIZE)


@dataclass(frozen=True, eq=False)
class CompiledEntry:
    """A C function; code : what keeps its machine code in memory."""

    address: int
    code: Any


@dataclass(frozen=True, eq=False)
class CompiledLaw:
    """A law as compiled entries.

    rate, update, sensitivity : entries.
    names : of the P parameters, in the order of theta.
    initial : (S,) states at time zero; limits : (S,) values at which the point has failed (inf: none).
    back_stresses : (S,) 1 of states that are back stresses, else 0.
    leading_exponent : function of theta (..., P) giving the exponent beta of time in strain ~ t^beta as t -> 0+ from a
        virgin state at constant stress, (...,). Where an exponent varies with the point, a second argument
        (..., 6 + S) says which; else it is taken at 100 MPa and 1000 K.
    """

    rate: CompiledEntry
    update: CompiledEntry
    sensitivity: CompiledEntry
    names: tuple[str, ...]
    initial: Floats
    limits: Floats
    back_stresses: Floats
    leading_exponent: Callable[..., Floats]
    source: str
    fingerprint: str

    @property
    def states(self) -> int:
        """Number of internal variables, S."""
        return int(self.initial.size)


_DOUBLE_POINTER = ctypes.POINTER(ctypes.c_double)


_C_FUNCTION = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, _DOUBLE_POINTER, _DOUBLE_POINTER, _DOUBLE_POINTER)


EntryName = Literal["rate", "update", "sensitivity"]


def call_entry(law: CompiledLaw, entry: EntryName, points: Floats, theta: Floats) -> tuple[Floats, int]:
    """Return an entry's output, (rows, columns), the columns as `interface` orders them, and its flags.

    points : (rows, 6 + S) variables of the law, in the units of x above. theta : (P,) internal parameters.
    """
    x, theta = np.ascontiguousarray(np.transpose(points), float), np.ascontiguousarray(theta, float)
    width, rows = x.shape
    columns = {"rate": 1, "update": 1 + width, "sensitivity": 1 + width + theta.size}[entry]
    out = np.empty(((1 + law.states) * columns, rows))
    pointers = (array.ctypes.data_as(_DOUBLE_POINTER) for array in (x, theta, out))
    flags = int(_C_FUNCTION(getattr(law, entry).address)(rows, *pointers))
    return np.ascontiguousarray(out.T), flags
