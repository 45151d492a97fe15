"""Checks of the settings of specimens: finite numbers within a range, whole ones where steps or threads are counted."""

from __future__ import annotations

import math
from numbers import Real
from typing import Any

from creepkit.errors import SolveError


def is_finite_number(value: Any) -> bool:
    """Whether a setting is one finite number, which True and False are not."""
    return not isinstance(value, bool) and isinstance(value, Real) and math.isfinite(value)


def is_whole_number(value: Any) -> bool:
    """Whether a setting is a finite number without a fraction: 1000 is, and so is 1e3."""
    return is_finite_number(value) and bool(value == int(value))


def check_number(specimen: str, name: str, value: object, allowed: str) -> None:
    """SolveError unless a setting is a finite number; allowed : the range, in words."""
    if not is_finite_number(value):
        raise SolveError(f"{specimen} specimen: {name} is {value!r}; allowed are finite numbers, {allowed}")


def check_whole_number(specimen: str, name: str, value: object, allowed: str) -> None:
    """SolveError unless a setting is a whole number; allowed : the range, in words."""
    if not is_whole_number(value):
        raise SolveError(f"{specimen} specimen: {name} is {value!r}; allowed are whole numbers, {allowed}")
