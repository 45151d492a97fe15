"""Points outside the ranges that the tests of an identification covered."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import FitError, FitWarning
from creepkit.records import ZERO_CELSIUS

RANGE_TOLERANCE = 1e-3
"""Relative distance from a range within which a point counts as inside: 1 K at 1000 K."""


UNITS = {"stress": " MPa", "temperature": " K", "time": " h", "strain": ""}


HOUR = 3600.0


def extrapolation_text(
    ranges: Mapping[str, tuple[float, float]],
    point: Mapping[str, ArrayLike | None],
    tolerances: Mapping[str, float] | None = None,
) -> str:
    """What of a point lies outside the fitted ranges, and by how much, in one sentence; "" when nothing does.

    ranges : {name: (low, high)}. point : {name: numbers (...,), or None for what is not given}; MPa, K, - and s.
    tolerances : {name: relative distance within which it counts as inside}, RANGE_TOLERANCE by default.
    """
    parts = []
    for name, given in point.items():
        if given is None or name not in ranges:
            continue
        (low, high), values = ranges[name], np.asarray(given, float)
        tolerance = (tolerances or {}).get(name, RANGE_TOLERANCE)
        if values.size and (values.min() < low * (1 - tolerance) or values.max() > high * (1 + tolerance)):
            if name == "time":
                low, high, values = low / HOUR, high / HOUR, values / HOUR
            least, largest, unit = float(values.min()), float(values.max()), UNITS.get(name, "")
            asked = f"{least:.4g}{unit}" if least == largest else f"{least:.4g} to {largest:.4g}{unit}"
            parts.append(
                f"{name} {asked} (the tests cover {low:.4g} to {high:.4g}{unit}{_distance(name, low, high, values)})"
            )
    return f"extrapolated: {', '.join(parts)}" if parts else ""


def _distance(name: str, low: float, high: float, values: Floats) -> str:
    """By how much values go beyond a range: kelvin of a temperature, a factor of all else."""
    below, above = low - float(values.min()), float(values.max()) - high
    if name == "temperature":
        return f"; {max(below, above):.3g} K beyond"
    if name == "time" and above > 0 and high > 0:
        return f"; {float(values.max()) / high:.3g} times the longest test"
    ratios = [float(values.max()) / high] if above > 0 and high > 0 else []
    ratios += [low / float(values.min())] if below > 0 and values.min() > 0 else []
    return f"; {max(ratios):.3g} times beyond" if ratios else ""


WRONG_UNIT_MARGIN = 100.0
"""K below the fitted range from which on a temperature that would lie in it in degrees Celsius is refused."""


def check_kelvin(ranges: Mapping[str, tuple[float, float]], temperature: ArrayLike | None) -> None:
    """FitError for a temperature far below the fitted ones that would be near them if it were meant in C.

    temperature : number or (...,) K.
    """
    if temperature is None or "temperature" not in ranges:
        return
    low, high = ranges["temperature"]
    for value in np.atleast_1d(np.asarray(temperature, float)).ravel():
        kelvin = float(value) + ZERO_CELSIUS
        if value < low - WRONG_UNIT_MARGIN and low - WRONG_UNIT_MARGIN <= kelvin <= high + WRONG_UNIT_MARGIN:
            raise FitError(
                f"temperature {value:g} K lies {low - value:.0f} K below the fitted tests ({low:.4g} to {high:.4g} K); "
                f"temperatures are in K: if {value:g} °C is meant, give {kelvin:g}; if not, pass warn=False"
            )


def warn_of_extrapolation(
    ranges: Mapping[str, tuple[float, float]], point: Mapping[str, ArrayLike | None], stacklevel: int = 4
) -> None:
    """FitWarning where a point lies outside the fitted ranges, one for all; FitError for a temperature in Celsius.

    point : {name: numbers (...,), or None} in MPa, K, - and s.
    stacklevel : frames above this one that the warning names: 4 for the caller of the method that calls
        this, which checks its arguments in a frame of its own.
    """
    check_kelvin(ranges, point.get("temperature"))
    sentence = extrapolation_text(ranges, point)
    if sentence:
        warnings.warn(sentence, FitWarning, stacklevel=stacklevel)
