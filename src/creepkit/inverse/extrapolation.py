"""Points outside the ranges that the tests of an identification covered."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import numpy as np

from creepkit.arrays import ArrayLike
from creepkit.errors import FitWarning

RANGE_TOLERANCE = 1e-3
"""Relative distance from a range within which a point counts as inside: 1 K at 1000 K."""


UNITS = {"stress": " MPa", "temperature": " K", "time": " s", "strain": ""}


def extrapolation_text(ranges: Mapping[str, tuple[float, float]], point: Mapping[str, ArrayLike | None]) -> str:
    """What of a point lies outside the fitted ranges, in one sentence; "" when nothing does.

    ranges : {name: (low, high)}. point : {name: numbers (...,), or None for what is not given}; MPa, K, - and s.
    """
    parts = []
    for name, given in point.items():
        if given is None or name not in ranges:
            continue
        (low, high), values = ranges[name], np.asarray(given, float)
        if values.size and (values.min() < low * (1 - RANGE_TOLERANCE) or values.max() > high * (1 + RANGE_TOLERANCE)):
            least, largest, unit = float(values.min()), float(values.max()), UNITS.get(name, "")
            asked = f"{least:.4g}{unit}" if least == largest else f"{least:.4g} to {largest:.4g}{unit}"
            parts.append(f"{name} {asked} (the tests cover {low:.4g} to {high:.4g}{unit})")
    return f"extrapolated: {', '.join(parts)}" if parts else ""


def warn_of_extrapolation(
    ranges: Mapping[str, tuple[float, float]], point: Mapping[str, ArrayLike | None], stacklevel: int = 3
) -> None:
    """FitWarning where a point lies outside the fitted ranges, one for all of it.

    point : {name: numbers (...,), or None} in MPa, K, - and s.
    stacklevel : frames above this one that the warning names: 3 for the caller of the method that calls this.
    """
    sentence = extrapolation_text(ranges, point)
    if sentence:
        warnings.warn(sentence, FitWarning, stacklevel=stacklevel)
