"""The compiled core: functions of `src/core`, called with NumPy arrays.

The library is plain C to its callers and is loaded by ctypes, which releases the lock of Python during a call.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from creepkit.errors import CreepkitError

LIBRARY_NAMES = {"darwin": "libcreepkit_core.dylib", "win32": "creepkit_core.dll"}


def library_path() -> Path:
    """Where the compiled library lies: beside this file."""
    return Path(__file__).with_name(LIBRARY_NAMES.get(sys.platform, "libcreepkit_core.so"))


@cache
def library() -> ctypes.CDLL:
    """The compiled library; CreepkitError when it is missing or cannot be loaded."""
    path = library_path()
    if not path.exists():
        raise CreepkitError(
            f"the compiled core of creepkit is missing ({path}); install creepkit again from a wheel, or from source "
            "with a C++ compiler or with 'pip install ziglang'"
        )
    try:
        return ctypes.CDLL(str(path))
    except OSError as error:
        raise CreepkitError(f"the compiled core of creepkit cannot be loaded: {error}; install creepkit again") from None


@cache
def function(name: str, result: Any = ctypes.c_int64) -> Callable[..., Any]:
    """A function of the library; arguments are ctypes numbers, or addresses from `address`."""
    entry = getattr(library(), name)
    entry.restype = result
    return entry  # type: ignore[no-any-return]


def address(array: np.ndarray) -> ctypes.c_void_p:
    """Address of the first number of a contiguous array of double or int64; the caller keeps the array alive."""
    if array.dtype not in (np.float64, np.int64) or not array.flags.c_contiguous:
        raise TypeError(f"the core takes contiguous arrays of float64 or int64, found {array.dtype}")
    return ctypes.c_void_p(array.ctypes.data)


class CoreStructure(ctypes.Structure):
    """A record that the core reads: numbers, and addresses of arrays that the caller keeps alive."""
