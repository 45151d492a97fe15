"""The compiled core: functions of `src/core`, called with NumPy arrays.

The library is plain C to its callers and is loaded by ctypes, which releases the lock of Python during a call. Two
environment variables are for developers: CREEPKIT_CORE, the absolute path of another library to load, such as the one
of `make sanitize`; and CREEPKIT_LANES, 2, 4 or 8, how many numbers of double the vectors hold that the core calculates
with (the most that the processor has).
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from creepkit.errors import CreepkitError

LIBRARY_NAMES = {"darwin": "libcreepkit_core.dylib", "win32": "creepkit_core.dll"}


INTERFACE_VERSION = 11
"""What `creepkit_core_version` of the library must return; both change when a function or its arguments do."""

REMEDY = "run 'make core' in a clone of the sources, or install creepkit again"


def library_path() -> Path:
    """Where the compiled library lies: beside this file, or where the environment variable CREEPKIT_CORE says."""
    chosen = os.environ.get("CREEPKIT_CORE")
    if chosen:
        if not (os.path.isabs(chosen) and os.path.isfile(chosen)):
            raise CreepkitError(f"CREEPKIT_CORE is '{chosen}', which is not the absolute path of a regular file")
        return Path(chosen)
    return Path(__file__).with_name(LIBRARY_NAMES.get(sys.platform, "libcreepkit_core.so"))


@cache
def library() -> ctypes.CDLL:
    """The compiled library; CreepkitError when it is missing, cannot be loaded, or is not the one of these sources."""
    path = library_path()
    if not path.is_file():
        raise CreepkitError(f"the compiled core of creepkit is missing ({path}); {REMEDY}")
    try:
        loaded = ctypes.CDLL(str(path))
        version = loaded.creepkit_core_version()
    except (OSError, AttributeError) as error:
        raise CreepkitError(f"the compiled core of creepkit cannot be loaded: {error}; {REMEDY}") from None
    if version != INTERFACE_VERSION:
        raise CreepkitError(
            f"the compiled core of creepkit has interface {version}, but this Python code needs {INTERFACE_VERSION} "
            f"({path}); {REMEDY}"
        )
    _check_lanes(loaded.creepkit_core_lanes())
    return loaded


def _check_lanes(lanes: int) -> None:
    """Refuse a CREEPKIT_LANES that the library did not follow."""
    wanted = os.environ.get("CREEPKIT_LANES")
    if wanted is not None and wanted != str(lanes):
        raise CreepkitError(
            f"CREEPKIT_LANES is '{wanted}', but this processor has vectors of {lanes} numbers at most; set 2, 4 or 8, "
            "and no more than it has, or leave it unset"
        )


@cache
def function(name: str, result: Any = ctypes.c_int64) -> Callable[..., Any]:
    """A function of the library; arguments are ctypes numbers, or addresses from `address`."""
    try:
        entry = getattr(library(), name)
    except AttributeError:
        raise CreepkitError(
            f"the compiled core of creepkit has no function {name} ({library_path()}); {REMEDY}"
        ) from None
    entry.restype = result
    return entry  # type: ignore[no-any-return]


class Address(ctypes.c_void_p):
    """Address of an array, which lives as long as this does.

    array : (...,).
    """

    array: np.ndarray


def address(array: np.ndarray) -> Address:
    """Address of the first number of a contiguous array (...,) of double or int64."""
    if array.dtype not in (np.float64, np.int64) or not array.flags.c_contiguous:
        raise TypeError(f"the core takes contiguous arrays of float64 or int64, found {array.dtype}")
    pointer = Address(array.ctypes.data)
    pointer.array = array
    return pointer


class CoreStructure(ctypes.Structure):
    """A record that the core reads: numbers, and addresses of arrays, which live as long as this does."""

    def __init__(self, *fields: Any, **named: Any) -> None:
        super().__init__(*fields, **named)
        self._kept = (fields, named)
