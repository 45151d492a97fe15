"""Aliases for arrays, used in signatures; shapes and units stand in the docstrings. Threads and cores."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from threadpoolctl import threadpool_limits

Floats: TypeAlias = NDArray[np.float64]


Ints: TypeAlias = NDArray[np.int64]


Bools: TypeAlias = NDArray[np.bool_]


__all__ = ["ArrayLike", "Bools", "Floats", "Ints", "frozen", "set_fields", "single_threaded_blas", "usable_cores"]


def frozen(values: ArrayLike | Sequence[Any], dtype: type = np.float64) -> NDArray[Any]:
    """A read-only contiguous copy, (...,), of values (...,)."""
    array: NDArray[Any] = np.array(values, dtype=dtype, order="C")
    array.flags.writeable = False
    return array


def set_fields(record: object, **values: Any) -> None:
    """Set fields of a frozen record while it is made."""
    for name, value in values.items():
        object.__setattr__(record, name, value)


def single_threaded_blas() -> AbstractContextManager[object]:
    """Limit BLAS to one thread inside a with statement."""
    manager: AbstractContextManager[object] = threadpool_limits(1, user_api="blas")
    return manager


def usable_cores() -> int:
    """How many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
