"""Functions of compiled kernels by themselves, called with arrays."""

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.kernels.compilation import LoadedCode, object_code
from creepkit.kernels.llvm_code import Module, add_entry


def compiled_function(formula: Callable[..., Any], arguments: int = 1) -> Callable[..., Floats]:
    """Compile a formula in kernel functions; the result takes arrays (points,) of one length: eight go as a vector."""
    module, pointer = Module(), ctypes.POINTER(ctypes.c_double)
    add_entry(module, "entry", lambda *values: (formula(*values),), (arguments, 0), rates=1)
    code = LoadedCode(object_code(str(module)))
    entry = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, pointer, pointer, pointer)(code.address("entry"))

    def call(*values: Floats) -> Floats:
        x, out = np.array(values, float), np.empty(len(values[0]))
        entry(len(out), *(array.ctypes.data_as(pointer) for array in (x, out, out)))
        return out

    call.code = code  # type: ignore[attr-defined]
    return call
