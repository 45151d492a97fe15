"""Which numbers of results differ between two runs by more than rounding."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

SAME_NUMBER = 1e-6
"""Relative difference up to which two numbers are taken as equal: other processors round otherwise."""


class Missing:
    """Stands for a number that one side does not have."""


MISSING = Missing()


def changed_numbers(old: Any, new: Any, place: str = "") -> Iterator[tuple[str, Any, Any]]:
    """(name, old, new) of numbers and texts that differ by more than rounding; MISSING where there is none."""
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        for key in [*old, *(one for one in new if one not in old)]:
            yield from changed_numbers(old.get(key, MISSING), new.get(key, MISSING), f"{place} {key}".strip())
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for first, second in zip(old, new, strict=True):
            yield from changed_numbers(first, second, place)
    elif isinstance(old, int | float) and isinstance(new, int | float):
        if not math.isclose(old, new, rel_tol=SAME_NUMBER, abs_tol=1e-300):
            yield place, old, new
    elif old != new:
        yield place, old, new
