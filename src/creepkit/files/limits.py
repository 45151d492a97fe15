"""How much a reader takes, and the one setting that allows more."""

from __future__ import annotations

import math
import os

from creepkit.errors import CreepkitError, quoted

VARIABLE = "CREEPKIT_LIMITS"
"""Environment variable: a number of 1 or more by which all limits on files that are read are multiplied."""


LARGEST_FACTOR = 1e6


def raised(limit: int) -> int:
    """A limit on files as it holds in this process: the usual one, or larger where the environment says so."""
    text = os.environ.get(VARIABLE, "").strip()
    if not text:
        return limit
    try:
        factor = float(text) if len(text) < 20 else math.nan
    except ValueError:
        factor = math.nan
    if not 1.0 <= factor <= LARGEST_FACTOR:
        raise CreepkitError(
            f"the environment variable {VARIABLE} is '{quoted(text)}'; write a number from 1 to {LARGEST_FACTOR:g}"
        )
    return int(limit * factor)


def how_to_raise(found: float, limit: int) -> str:
    """What to do where more was found than `limit` allows today, as the end of a sentence."""
    usual = limit / (raised(1_000_000) / 1e6)
    needed = min(found / usual, LARGEST_FACTOR) if math.isfinite(found) else 10.0
    return f"if it is right, {VARIABLE}={max(math.ceil(needed * 1.05), 2)} in the environment allows more"
