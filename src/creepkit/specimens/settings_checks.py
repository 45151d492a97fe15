"""Checks of the settings of specimens: finite numbers within a range, whole ones where steps or threads are counted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from numbers import Real
from typing import Any

from creepkit.errors import SolveError


def check_ranges(
    specimen: Any, ranges: Mapping[str, tuple[float, float]], whole: tuple[str, ...] = ("max_steps", "threads")
) -> None:
    """SolveError unless settings are finite numbers within their ranges, whole ones where they count.

    ranges : {setting: (lowest, highest)}, both allowed but for a lowest of zero.
    """
    for name, (low, high) in ranges.items():
        value = getattr(specimen, name)
        number = not isinstance(value, bool) and isinstance(value, Real) and math.isfinite(value)
        if not (number and low <= value <= high and value != 0.0 and (name not in whole or value == int(value))):
            kind = "whole" if name in whole else "finite"
            allowed = f"{low:.15g} to {high:.15g}" if low > 0.0 else f"above 0, up to {high:.15g}"
            raise SolveError(f"{specimen.name} specimen: {name} is {value!r}; allowed are {kind} numbers, {allowed}")
