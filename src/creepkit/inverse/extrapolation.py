"""Points outside the ranges, and the combinations of stress and temperature, that the tests of a fit covered."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import FitError, FitWarning
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE
from creepkit.language import CreepLaw, temperature
from creepkit.records import ZERO_CELSIUS, PointLoading
from creepkit.records.units import celsius_text

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification

RANGE_TOLERANCE = 1e-3
"""Relative distance from a range within which a point counts as inside: 1 K at 1000 K."""


UNITS = {"stress": " MPa", "temperature": " K", "time": " h", "strain": ""}


HOUR = 3600.0


UNSEEN_RUPTURE = (
    "no fitted test broke: this is when the bar would tear by the growth of strain alone; damage breaks it sooner"
)
"""Of a rupture that a law without ruptures among its tests predicts."""


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
        if values.size and (values.min() < low - tolerance * abs(low) or values.max() > high + tolerance * abs(high)):
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


def check_kelvin(ranges: Mapping[str, tuple[float, float]], given: ArrayLike | None) -> None:
    """FitError for a temperature far below the fitted ones that would be near them if it were meant in C.

    given : number or (...,) K, or None.
    """
    if given is None or "temperature" not in ranges:
        return
    low, high = ranges["temperature"]
    for value in np.atleast_1d(np.asarray(given, float)).ravel():
        kelvin = float(value) + ZERO_CELSIUS
        if value < low - WRONG_UNIT_MARGIN and low - WRONG_UNIT_MARGIN <= kelvin <= high + WRONG_UNIT_MARGIN:
            raise FitError(
                f"temperature {value:g} K lies {low - value:.0f} K below the fitted tests ({low:.4g} to {high:.4g} K); "
                f"temperatures are in K: if {value:g} °C is meant, give {kelvin:g}; if not, pass warn=False"
            )


def check_isothermal(
    laws: Sequence[CreepLaw], ranges: Mapping[str, tuple[float, float]], given: ArrayLike | None
) -> None:
    """FitError for another temperature than that of the tests where a law has none; given : (...,) K, or None."""
    isothermal = [law.name for law in laws if not law.uses(temperature)]
    if given is None or "temperature" not in ranges or not isothermal:
        return
    (low, high), name = ranges["temperature"], isothermal[0]
    values = np.atleast_1d(np.asarray(given, float)).ravel()
    beyond = np.maximum(low - values, values - high)
    if beyond.max(initial=0.0) > ISOTHERMAL_RANGE:
        raise FitError(
            f"law '{name}' has no temperature, and its tests were at {celsius_text(low, high)}: nothing is known of "
            f"{celsius_text(float(values[np.argmax(beyond)]))}; add tests at another temperature, or fit the law times "
            f"an activation energy of the literature, such as ck.law('{name}').times(ck.arrhenius(T_ref={low:.6g}, "
            "Q=300e3)) in J/mol"
        )


def warn_of_extrapolation(
    laws: Sequence[CreepLaw],
    ranges: Mapping[str, tuple[float, float]],
    point: Mapping[str, ArrayLike | None],
    stacklevel: int = 4,
) -> None:
    """FitWarning where a point lies outside the fitted ranges, one for all; FitError of a wrong temperature.

    point : {name: numbers (...,), or None} in MPa, K, - and s.
    stacklevel : frames above this one that the warning names: 4 for the caller of the method that calls
        this, which checks its arguments in a frame of its own.
    """
    check_kelvin(ranges, point.get("temperature"))
    check_isothermal(laws, ranges, point.get("temperature"))
    sentence = extrapolation_text(ranges, point)
    if sentence:
        warnings.warn(sentence, FitWarning, stacklevel=stacklevel)


# ---- combinations of stress and temperature ----------------------------------------------------------------------

SAME_TEMPERATURE = 2.0
"""K between tests of one temperature."""


SAME_STRESS = 0.01
"""Relative distance of stresses within which they are one."""


def tested_points(fit: Identification) -> Floats:
    """(points, 2) stress, MPa, and temperature, K, that the fitted tests saw together; none without their histories.

    Of an imposed stress those of its readings: one that falls as the furnace is made hotter was never held at both
    larger values. Where the specimen makes the stress, each that it goes through at each temperature of its test.
    """
    pairs = [np.zeros((0, 2))]
    for history, stresses in zip(fit.histories, fit.simulated_stresses, strict=True):
        times = history.used_times
        temperatures = history.temperature_program().at(times)
        if history.loading.quantity == "stress" and not isinstance(history.loading, PointLoading):
            loads = np.abs(history.loading.program().at(times))
            held = loads >= (1.0 - SAME_STRESS) * stresses.min(initial=np.inf)  # not those of a ramp that loaded it
            pairs.append(np.column_stack([loads, temperatures])[held])
        else:
            pairs.append(np.stack(np.meshgrid(stresses, np.unique(temperatures.round(1))), axis=-1).reshape(-1, 2))
    points = np.concatenate(pairs)
    points = points[points[:, 0] > 0]
    same = np.round(np.column_stack([1e3 * np.log(points[:, 0]), 10.0 * points[:, 1]]))  # to 0.1 % and 0.1 K
    return np.asarray(points[np.unique(same, axis=0, return_index=True)[1]])


def stresses_at_temperatures(fit: Identification) -> list[tuple[float, tuple[float, float]]]:
    """(temperature, K, and the lowest and the highest stress there, MPa), the coldest first."""
    points = tested_points(fit)
    found: list[tuple[float, tuple[float, float]]] = []
    for T, stress in sorted((float(T), float(s)) for s, T in points):
        if found and T - found[-1][0] <= SAME_TEMPERATURE:
            first, (low, high) = found[-1]
            found[-1] = (first, (min(low, stress), max(high, stress)))
        else:
            found.append((T, (stress, stress)))
    return found


def outside_combinations(fit: Identification, stresses: Floats, temperatures: Floats) -> str:
    """Which combination of stress and temperature lies outside the region of the tests; "" where none does.

    The region is the convex hull of (1/T, ln stress) of the tests, widened by SAME_STRESS and SAME_TEMPERATURE.
    stresses : (n,) MPa. temperatures : (n,) K.
    """
    tested = tested_points(fit)
    if not tested.size:
        return ""
    tested_x, tested_y = 1.0 / tested[:, 1], np.log(tested[:, 0])
    for stress, T in dict.fromkeys(zip(stresses.tolist(), temperatures.tolist(), strict=True)):
        if not (stress > 0 and T > 0):
            continue
        allowed = [
            _stress_span(tested_x, tested_y, 1.0 / (T + dT)) for dT in (0.0, -SAME_TEMPERATURE, SAME_TEMPERATURE)
        ]
        spans = [span for span in allowed if span is not None]
        if not spans or any(low - SAME_STRESS <= np.log(stress) <= high + SAME_STRESS for low, high in spans):
            continue  # a temperature beyond all tests is said of the temperature
        low, high = np.exp(spans[0])
        return (
            f"stress {stress:.4g} MPa at {celsius_text(T, digits=0)} (the tests' region in 1/T and ln stress holds "
            f"{low:.4g} to {high:.4g} MPa there)"
        )
    return ""


def _stress_span(x: Floats, y: Floats, at: float) -> tuple[float, float] | None:
    """The lowest and the highest ordinate of the convex hull of points (n,) at an abscissa; None beside all points."""
    same = np.abs(x - at) <= 1e-12 * at
    values = [*y[same]]
    below, above = np.flatnonzero(x < at), np.flatnonzero(x > at)
    if below.size and above.size:  # the ends of the hull lie on lines between two points
        share = (at - x[below, None]) / (x[above] - x[below, None])
        lines = y[below, None] + share * (y[above] - y[below, None])
        values += [float(lines.min()), float(lines.max())]
    return (float(min(values)), float(max(values))) if values else None
